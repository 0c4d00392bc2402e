#pragma once

#include <ostream>

#include "apps/clip/clip.hpp"

namespace nbd {

/// Writes the vertices of a body in all frames as a LightWave point cache (.mdd): numbers of frames and
/// vertices, the frames' times from 0 on, positions; big-endian, 4 bytes each.
void write_mdd(std::ostream& out, const Clip& clip, int body);

/// Likewise as a point cache of 3ds Max (.pc2), little-endian: it has no times, one sample is one frame.
void write_pc2(std::ostream& out, const Clip& clip, int body);

}  // namespace nbd
