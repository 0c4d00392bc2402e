#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "training/files/dataset_manifest.hpp"
#include "training/files/recording.hpp"
#include "training/files/tree_file.hpp"

namespace nbd {

/// Draws the trajectories that training never sees. share: of `ids`, in [0, 1); a share above 0 holds out at
/// least one. The draw of a trajectory depends on the seed and its id alone. Throws std::invalid_argument on
/// a share out of range.
DatasetSplit draw_held_out(std::vector<int> ids, double share, std::uint64_t seed);

/// Draws the held-out and the calibration trajectories and fixes which frames of the others are kept out of
/// training. Failed and empty trajectories are in none of the lists.
/// held_out_share: of the complete trajectories, as in draw_held_out(); if not given, the manifest of a
/// dataset names them, and without a manifest it is a fifth. calibration_share: of the others, in [0, 1);
/// ignored if there is only one. It does not change which trajectories are held out. random_frame_share: of
/// the remaining frames, in [0, 1). split: name of a dataset's split to take instead of a share; may be
/// empty. The result depends on the trajectories' ids, the shares, the seed and the manifest alone. Throws
/// std::invalid_argument on a share out of range, std::runtime_error if no complete trajectory is left for
/// training, or without a split of this name.
TrainingSplit make_split(const RecordingReader& recording, std::optional<double> held_out_share,
                         double random_frame_share, std::uint64_t seed, double calibration_share = 0,
                         const std::string& split = {});

/// A frame of a recording.
struct FrameId {
    int trajectory = 0;  // index into RecordingReader::trajectories(), not its id
    int frame = 0;
    auto operator<=>(const FrameId&) const = default;
};

/// The four parts of a split recording. Disjoint; together they hold all frames of the split's trajectories,
/// except those of steps that went wrong, unless the split wants them.
enum class FrameSet { train, random_test, calibration, held_out };

/// Frames of one part, ascending. Skips trajectories that the recording does not have.
std::vector<FrameId> frames_of(const RecordingReader& recording, const TrainingSplit& split, FrameSet set);

/// All frames of the complete trajectories, ascending, except those of steps that went wrong.
std::vector<FrameId> complete_frames(const RecordingReader& recording);

/// How many frames of the complete trajectories are of steps that went wrong.
int troubled_frames(const RecordingReader& recording);

/// At most `count` of the frames, evenly spread.
std::vector<FrameId> spread(std::span<const FrameId> frames, int count);

}  // namespace nbd
