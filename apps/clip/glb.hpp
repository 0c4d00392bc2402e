#pragma once

#include <ostream>

#include "apps/clip/clip.hpp"

namespace nbd {

/// Most frames of a clip as glTF: each one after the first is a morph target, which programs hold in memory.
inline constexpr int most_glb_frames = 240;

/// Writes a clip as binary glTF 2.0. Each body is a mesh of its own whose vertices are those of the surface,
/// in order and in world space; its first frame is the mesh, each other one a morph target with positions and
/// normals, and an animation goes from one to the next at their times. A node above them turns `up` to +y.
/// Throws std::invalid_argument for more than most_glb_frames frames, or more than the 4 GiB that a file can
/// hold.
void write_glb(std::ostream& out, const Clip& clip);

}  // namespace nbd
