#include "training/files/recording_hash.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <span>

#include "collision/base/stop.hpp"
#include "meshing/h5/sha256.hpp"
#include "meshing/progress/progress.hpp"

namespace nbd {

std::string recording_hash(
    const RecordingReader& recording,
    const std::function<void(int trajectory, int begin, int count, const Vertices& nodes)>& seen) {
    constexpr int frames_at_once = 64;
    h5::Sha256 hash;
    Vertices x;
    double read = 0;
    const auto& infos = recording.trajectories();
    for (int i = 0; i < static_cast<int>(infos.size()); ++i) {
        const TrajectoryInfo& info = infos[static_cast<std::size_t>(i)];
        const std::string head =
            fmt::format("{} {} {} {}\n", info.id, info.frames, recording.nodes(i), info.failure);
        hash.add(std::as_bytes(std::span(head)));
        for (int begin = 0; begin < info.frames; begin += frames_at_once) {
            stop_if_asked();
            const int count = std::min(frames_at_once, info.frames - begin);
            recording.read(i, begin, count, x);
            hash.add(std::as_bytes(std::span(x.data(), static_cast<std::size_t>(x.size()))));
            if (seen) seen(i, begin, count, x);
            tell_progress("frames", read += count, static_cast<double>(recording.frames()));
        }
    }
    return hash.hex();
}

}  // namespace nbd
