#include "training/files/split.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "collision/base/counter_random.hpp"

namespace nbd {

namespace {

void check_share(const char* what, double share) {
    if (!(share >= 0 && share < 1))
        throw std::invalid_argument(fmt::format("share of {} {}; allowed: [0, 1)", what, share));
}

/// The frames of a trajectory, by its index; with those of steps that went wrong only if they are wanted.
std::vector<int> frames_of(const RecordingReader& recording, int trajectory, bool with_troubled) {
    const std::vector<std::int32_t>& troubled = recording.facts(trajectory).troubled;
    std::vector<int> frames;
    for (int frame = 0; frame < recording.trajectories()[trajectory].frames; ++frame)
        if (with_troubled || troubled.empty() || troubled[frame] == 0) frames.push_back(frame);
    return frames;
}

DatasetSplit stored_split(const RecordingReader& recording, const std::string& name) {
    if (!recording.is_dataset())
        throw std::runtime_error(
            fmt::format("{}: is not a dataset, so it has no split \"{}\"", recording.path().string(), name));
    try {
        return read_dataset_manifest(recording.path()).split(name);
    } catch (const std::invalid_argument& error) {
        throw std::runtime_error(fmt::format("{}: {}", recording.path().string(), error.what()));
    }
}

}  // namespace

bool is_random_test_frame(const TrainingSplit& split, int trajectory, int frame) noexcept {
    return counter_uniform(split.frame_seed, static_cast<std::uint64_t>(trajectory), frame) <
           static_cast<double>(split.random_frame_share);
}

DatasetSplit draw_held_out(std::vector<int> ids, double share, std::uint64_t seed) {
    check_share("held-out trajectories", share);
    const std::ptrdiff_t count = ids.size();
    std::ptrdiff_t held_out = std::lround(share * static_cast<double>(count));
    if (share > 0) held_out = std::min(count, std::max<std::ptrdiff_t>(held_out, 1));
    // Holding out the lowest draws makes a trajectory's draw independent of the other trajectories.
    std::ranges::sort(ids, {}, [seed](int id) {
        return std::pair(counter_random(seed, static_cast<std::uint64_t>(id), 0), id);
    });
    DatasetSplit split{.name = {},
                       .train = {ids.begin() + held_out, ids.end()},
                       .held_out = {ids.begin(), ids.begin() + held_out}};
    std::ranges::sort(split.train);
    std::ranges::sort(split.held_out);
    return split;
}

TrainingSplit make_split(const RecordingReader& recording, std::optional<double> held_out_share,
                         double random_frame_share, std::uint64_t seed, double calibration_share,
                         const std::string& split_name) {
    check_share("calibration trajectories", calibration_share);
    check_share("random test frames", random_frame_share);
    const double share = held_out_share.value_or(0.2);
    DatasetSplit split;
    if (!split_name.empty()) {
        split = stored_split(recording, split_name);
    } else if (!held_out_share && recording.is_dataset()) {
        split = stored_split(recording, trajectory_split);
    } else {
        std::vector<int> ids;
        for (const TrajectoryInfo& t : recording.trajectories())
            if (t.failure.empty() && t.frames > 0) ids.push_back(t.id);
        split = draw_held_out(std::move(ids), share, seed);
    }
    DatasetSplit rest = draw_held_out(split.train, split.train.size() < 2 ? 0 : calibration_share,
                                      counter_random(seed, 0, 2));
    if (rest.train.empty())
        throw std::runtime_error(fmt::format(
            "{}: has {} complete trajectories, and holding out {} of them leaves none to train on",
            recording.path().string(), split.train.size() + split.held_out.size(),
            std::max(split.held_out.size() + rest.held_out.size(), std::size_t{share > 0})));
    return {.train_trajectories = std::move(rest.train),
            .calibration_trajectories = std::move(rest.held_out),
            .held_out_trajectories = std::move(split.held_out),
            .frame_seed = counter_random(seed, 0, 1),
            .random_frame_share = static_cast<float>(random_frame_share)};
}

std::vector<FrameId> frames_of(const RecordingReader& recording, const TrainingSplit& split, FrameSet set) {
    const bool whole = set == FrameSet::held_out || set == FrameSet::calibration;
    const auto& trajectories = set == FrameSet::held_out      ? split.held_out_trajectories
                               : set == FrameSet::calibration ? split.calibration_trajectories
                                                              : split.train_trajectories;
    std::vector<FrameId> frames;
    const auto& infos = recording.trajectories();
    for (std::size_t i = 0; i < infos.size(); ++i) {
        const int id = infos[i].id;
        if (std::ranges::find(trajectories, id) == trajectories.end()) continue;
        for (const int frame : frames_of(recording, i, split.troubled_frames))
            if (whole || is_random_test_frame(split, id, frame) == (set == FrameSet::random_test))
                frames.push_back({static_cast<int>(i), frame});
    }
    return frames;
}

std::vector<FrameId> complete_frames(const RecordingReader& recording) {
    std::vector<FrameId> frames;
    const auto& infos = recording.trajectories();
    for (std::size_t i = 0; i < infos.size(); ++i)
        if (infos[i].failure.empty())
            for (const int frame : frames_of(recording, i, false))
                frames.push_back({static_cast<int>(i), frame});
    return frames;
}

int troubled_frames(const RecordingReader& recording) {
    std::ptrdiff_t count = 0;
    for (int i = 0; const TrajectoryInfo& info : recording.trajectories()) {
        const std::vector<std::int32_t>& troubled = recording.facts(i++).troubled;
        if (info.failure.empty())
            count += std::ranges::count_if(troubled, [](int steps) { return steps > 0; });
    }
    return count;
}

std::vector<FrameId> spread(std::span<const FrameId> frames, int count) {
    const long all = frames.size();
    if (all <= count) return {frames.begin(), frames.end()};
    std::vector<FrameId> chosen;
    for (long i = 0; i < count; ++i) chosen.push_back(frames[i * all / count]);
    return chosen;
}

}  // namespace nbd
