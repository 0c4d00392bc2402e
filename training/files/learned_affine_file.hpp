#pragma once

#include "collision/wide_tree/learned_affine.hpp"
#include "meshing/h5/reader.hpp"
#include "meshing/h5/writer.hpp"

namespace nbd {

/// Write and read the group `learned_affine`, without the rest positions X, which are those of the surface.
/// read_learned_affine() throws std::runtime_error on wrong types or shapes; LearnedAffineModel checks the
/// rest.
void write_learned_affine(h5::Writer& file, const LearnedAffineFit& fit);
LearnedAffineFit read_learned_affine(const h5::Reader& file, const Vertices& X);

}  // namespace nbd
