#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "apps/bench/pairs/bench_body.hpp"
#include "training/evaluate/contact_scenes.hpp"
#include "training/files/recording.hpp"

namespace nbd {

/// Two touching copies of a body, given by the positions of their nodes, [N, 3] each. The same scene for
/// every surface that the nodes carry.
struct TouchingScene {
    Vertices a, b;
    int pairs = 0;  // intersecting pairs on the surface it was placed with
};

struct TouchingScenesConfig {
    int scenes = 10;
    int pairs =
        30;  // intersecting face pairs of the coarse surface: at least this many, at most half as many more
    std::uint64_t seed = 1;
};

/// Draws each scene with draw_contact_placement(), then moves the second body on after first contact in steps
/// of 1/400 of the radius until enough faces intersect. Draws again if a step brings too many or no step is
/// enough. Throws std::invalid_argument on no frames or a config out of range, std::runtime_error if 50 draws
/// per scene are not enough.
std::vector<TouchingScene> make_touching_scenes(const BenchBody& coarse, const RecordingReader& recording,
                                                std::span<const FrameId> frames,
                                                const TouchingScenesConfig& config);

/// Frames of a simulated scene of two copies of the body: at most `most`, evenly spread over those in which
/// faces of the two come within `distance`, metres. Throws std::runtime_error unless the recording has two
/// copies of this body, or if there is no such frame.
std::vector<TouchingScene> recorded_scenes(const BenchBody& coarse, const RecordingReader& recording,
                                           float distance, int most);

/// Frames of trajectories that no body's tree was trained or calibrated on; all complete frames if no tree
/// was trained. Throws std::runtime_error if none is left.
std::vector<FrameId> unseen_frames(std::span<const BenchBody> bodies, const RecordingReader& recording);

}  // namespace nbd
