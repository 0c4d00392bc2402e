#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "apps/bench/pairs/bench_body.hpp"
#include "training/evaluate/contact_placement.hpp"
#include "training/files/recording.hpp"

namespace nbd {

/// Two copies of a body that touch, by the positions of their nodes, [N, 3] each: the same scene for every
/// surface that the nodes carry.
struct TouchingScene {
    Vertices a, b;
    int pairs = 0;    // of the surface it was placed with
    float depth = 0;  // how far the second body went on after they touched, metres
};

struct TouchingScenesConfig {
    int scenes = 10;
    int pairs = 30;  // faces pairs of the coarse surface that intersect, at least; at most half as many more
    std::uint64_t seed = 1;
};

/// Draws frames, a turn and a side for each scene as draw_contact_placement(), and moves the second body on
/// after they touch in steps of 1/400 of the radius until enough faces intersect; draws again where a step
/// brings too many, or none is enough. Throws std::invalid_argument on no frames or a config out of range,
/// std::runtime_error where 50 draws a scene do not do.
std::vector<TouchingScene> make_touching_scenes(const BenchBody& coarse, const RecordingReader& recording,
                                                std::span<const FrameId> frames,
                                                const TouchingScenesConfig& config);

/// Likewise scenes in which the second body goes on after they touch by `depth`, in radii: no draw is given
/// up. Throws std::invalid_argument on no frames, no scenes, or a depth outside 0 to 2.
std::vector<TouchingScene> make_scenes_of_depth(const BenchBody& coarse, const RecordingReader& recording,
                                                std::span<const FrameId> frames, int scenes, double depth,
                                                std::uint64_t seed);

/// Frames of a scene that the simulator recorded with two copies of the body, at most `most`, evenly spread
/// over those in which faces of the two come within `distance`, metres. Throws std::runtime_error unless the
/// recording is of two bodies alike, or where there is no such frame.
std::vector<TouchingScene> recorded_scenes(const BenchBody& coarse, const RecordingReader& recording,
                                           float distance, int most);

/// Frames of trajectories that no body's tree was trained or calibrated on; all complete ones where none was
/// trained. Throws std::runtime_error where none is left.
std::vector<FrameId> unseen_frames(std::span<const BenchBody> bodies, const RecordingReader& recording);

}  // namespace nbd
