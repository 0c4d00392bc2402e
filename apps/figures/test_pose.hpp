#pragma once

#include "training/evaluate/evaluate.hpp"

namespace nbd {

/// A recorded pose of a tree's surface for pictures, rigidly aligned with the rest pose.
struct TestPose {
    int trajectory = 0, frame = 0;  // id of the trajectory in its recording
    double deformation = 0;         // mean distance of the vertices from the rest pose, relative to its size
    Vertices x;                     // [n, 3]
};

/// The frame with the median deformation among a few frames, evenly spread. frames: of the recording, at
/// least one.
TestPose typical_pose(const TreeFile& tree, const RecordingReader& recording,
                      std::span<const FrameId> frames);

}  // namespace nbd
