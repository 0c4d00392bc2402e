#pragma once

#include <vector>

#include "meshing/surface/mesh.hpp"

namespace nbd {

/// Where the vertices of a surface are at some times. They go straight from one frame to the next, and stand
/// before the first and after the last.
struct SurfaceFrames {
    std::vector<double> times;     // seconds, each later than the one before
    std::vector<Nodes> positions;  // of each, [n, 3] metres

    Nodes at(double time) const;
    /// Whether the vertices are where they are all the time between two times.
    bool stand(double begin, double end) const;
};

/// Throws std::invalid_argument unless there are a time and n finite positions for each frame, and times
/// ascend.
void check_frames(const SurfaceFrames& frames, Eigen::Index n);

}  // namespace nbd
