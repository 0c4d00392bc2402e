#pragma once

#include <filesystem>

#include "meshing/body/body.hpp"

namespace nbd {

struct RemappedFrames {
    int trajectories = 0, frames = 0;
};

/// Writes a recording of `from` as one of `to`, which has the same tetrahedra and another surface. Leaves out
/// contact edges and counts of self-intersections, which are of the surface, and gives a notice of it where
/// there are edges. trajectories: at most so many, starting with the first; 0: all. Tells its progress.
/// Throws std::runtime_error if the tetrahedra differ or a trajectory is of another body; StopAsked as
/// stop_if_asked(). Nothing is written then.
RemappedFrames remap_recording(const std::filesystem::path& recording, const Body& from, const Body& to,
                               const std::filesystem::path& output, int trajectories);

}  // namespace nbd
