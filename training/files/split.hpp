#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "training/files/recording.hpp"
#include "training/files/tree_file.hpp"

namespace nbd {

/// Trajectories by their ids, ascending.
struct HeldOut {
    std::vector<int> train, held_out;
};

/// Draws which trajectories training never sees. share: of them, in [0, 1); above 0 at least one is held out.
/// Whether a trajectory is drawn early depends on the seed and its id alone. Throws std::invalid_argument on
/// a share out of range.
HeldOut draw_held_out(std::vector<int> ids, double share, std::uint64_t seed);

/// Draws the trajectories that training never sees and fixes how frames are kept out of the others. Failed
/// and empty trajectories are in neither list. held_out_share: of the complete trajectories, as in
/// draw_held_out; without one, those that the manifest of a dataset names, and a fifth where there is none.
/// calibration_share: of the others, kept for calibration, in [0, 1), none
/// where there is one alone; so a dataset's held-out trajectories are
/// the same with and without. random_frame_share: of the remaining frames, in [0, 1). Depends on the
/// trajectories' ids, the shares and the seed, and on the manifest, alone. Throws std::invalid_argument on a
/// share out of range, std::runtime_error where the recording has too few complete trajectories to leave one
/// for training.
TrainingSplit make_split(const RecordingReader& recording, std::optional<double> held_out_share,
                         double random_frame_share, std::uint64_t seed, double calibration_share = 0);

/// A frame of a recording.
struct FrameId {
    int trajectory = 0;  // index into RecordingReader::trajectories(), not its id
    int frame = 0;
    auto operator<=>(const FrameId&) const = default;
};

/// The four parts that a split makes of a recording. Disjoint; together all frames of its trajectories.
enum class FrameSet { train, random_test, calibration, held_out };

/// Frames of one part, ascending. Trajectories that the recording does not have are skipped.
std::vector<FrameId> frames_of(const RecordingReader& recording, const TrainingSplit& split, FrameSet set);

/// All frames of the complete trajectories, ascending.
std::vector<FrameId> complete_frames(const RecordingReader& recording);

/// At most `count` of the frames, evenly spread.
std::vector<FrameId> spread(std::span<const FrameId> frames, int count);

}  // namespace nbd
