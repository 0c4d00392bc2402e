#include <fmt/core.h>

#include <algorithm>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>

#include "apps/cli/load_body.hpp"
#include "meshing/body/body.hpp"
#include "training/files/recording.hpp"

namespace nbd {

const SceneFiles::Recorded& SceneFiles::recorded(const SurfaceRecording& from) {
    const std::string file = from.file.string();
    const std::string key = fmt::format("{}|{}|{}", file, from.body.string(), from.trajectory);
    if (const auto known = recorded_.find(key); known != recorded_.end()) return known->second;
    const Body body = load_body(from.body);
    const RecordingReader recording(from.file);
    const std::vector<TrajectoryInfo>& all = recording.trajectories();
    const auto found = std::ranges::find(all, from.trajectory, &TrajectoryInfo::id);
    if (found == all.end())
        throw std::invalid_argument(
            fmt::format("{}: has no trajectory {}, but {} of them from {} to {}", file, from.trajectory,
                        all.size(), all.empty() ? 0 : all.front().id, all.empty() ? 0 : all.back().id));
    const int trajectory = static_cast<int>(found - all.begin());
    if (found->body_hash != body_hash(body) || recording.nodes(trajectory) != body.tets.X.rows())
        throw std::invalid_argument(
            fmt::format("{}: trajectory {} is of another body than {}", file, found->id, from.body.string()));
    if (found->frames == 0)
        throw std::invalid_argument(fmt::format("{}: trajectory {} has no frames", file, found->id));
    SurfaceFrames frames{recording.times(trajectory), {}};
    Vertices x;
    for (int k = 0; k < found->frames; ++k) {
        recording.read(trajectory, k, 1, x);
        frames.positions.push_back(embedded(body.W, Nodes(x.cast<double>())).rowwise() +
                                   recording.origin().transpose());
    }
    try {
        check_frames(frames, body.surface.X.rows());
    } catch (const std::invalid_argument& error) {
        throw std::invalid_argument(fmt::format("{}: {}", file, error.what()));
    }
    return recorded_[key] = {body.surface.F, std::make_shared<const SurfaceFrames>(std::move(frames))};
}

void SceneFiles::load_recordings(SceneSpec& spec) {
    for (std::size_t o = 0; o < spec.obstacles.size(); ++o) {
        SceneObstacle& obstacle = spec.obstacles[o];
        if (!obstacle.recording || obstacle.frames) continue;
        if (obstacle.recording->file.empty() || obstacle.recording->body.empty())
            continue;  // told by the reader
        try {
            const Recorded& known = recorded(*obstacle.recording);
            SurfaceFrames frames = *known.frames;
            for (double& time : frames.times)
                time = obstacle.recording->start + time / obstacle.recording->speed;
            obstacle.made = {frames.at(0), known.F};
            obstacle.frames = std::make_shared<const SurfaceFrames>(std::move(frames));
        } catch (const std::invalid_argument& error) {
            throw std::invalid_argument(fmt::format("obstacles[{}].recording: {}", o, error.what()));
        } catch (const std::runtime_error& error) {
            throw std::runtime_error(fmt::format("obstacles[{}].recording: {}", o, error.what()));
        }
    }
}

}  // namespace nbd
