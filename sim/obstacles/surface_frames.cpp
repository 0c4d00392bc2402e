#include "sim/obstacles/surface_frames.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace nbd {

Nodes SurfaceFrames::at(double time) const {
    const auto next = std::ranges::upper_bound(times, time);
    if (next == times.begin()) return positions.front();
    if (next == times.end()) return positions.back();
    const std::size_t k = next - times.begin();
    const double share = (time - times[k - 1]) / (times[k] - times[k - 1]);
    return positions[k - 1] + share * (positions[k] - positions[k - 1]);
}

bool SurfaceFrames::stand(double begin, double end) const {
    const Nodes first = at(begin);
    if (first != at(end)) return false;
    for (std::size_t k = 0; k < times.size(); ++k)
        if (times[k] > begin && times[k] < end && positions[k] != first) return false;
    return true;
}

void check_frames(const SurfaceFrames& frames, Eigen::Index n) {
    if (frames.times.empty() || frames.times.size() != frames.positions.size())
        throw std::invalid_argument(fmt::format("frames: {} times for {} positions of the surface",
                                                frames.times.size(), frames.positions.size()));
    for (std::size_t k = 0; k < frames.times.size(); ++k) {
        if (frames.positions[k].rows() != n || !frames.positions[k].allFinite())
            throw std::invalid_argument(fmt::format("frames: frame {} needs {} finite positions, it has {}",
                                                    k, n, frames.positions[k].rows()));
        if (!std::isfinite(frames.times[k]) || (k > 0 && !(frames.times[k] > frames.times[k - 1])))
            throw std::invalid_argument(
                fmt::format("frames: frame {} is at {} s, but times must ascend", k, frames.times[k]));
    }
}

}  // namespace nbd
