#pragma once

#include "training/evaluate/evaluate.hpp"

namespace nbd {

/// A recorded pose of a tree's surface, turned and moved to lie on the rest pose as well as a rigid motion
/// can, for pictures.
struct TestPose {
    int trajectory = 0, frame = 0;  // id of the trajectory in its recording
    double deformation = 0;  // mean distance of the vertices from the rest pose, over the rest pose's size
    Vertices x;              // [n, 3]
};

/// The frame of the middle deformation among a few, evenly spread over the frames. frames: of the recording,
/// at least one.
TestPose typical_pose(const TreeFile& tree, const RecordingReader& recording,
                      std::span<const FrameId> frames);

}  // namespace nbd
