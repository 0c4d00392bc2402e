#pragma once

#include "collision/bounds/certified/certified_model.hpp"
#include "collision/geometry/tet_mesh.hpp"
#include "meshing/h5/reader.hpp"
#include "meshing/h5/writer.hpp"

namespace nbd {

/// Write and read the group `certified` of a tree file. read_certified() throws std::runtime_error on wrong
/// types, shapes or numbers; check_certified_model() checks the rest.
void write_certified(h5::Writer& file, const CertifiedModel& model);
CertifiedModel read_certified(const h5::Reader& file, std::size_t nodes);

/// Writes the group `solid`: the tetrahedra that move the surface.
void write_solid(h5::Writer& file, const TetMesh& solid);
/// Reads the group `solid`. Throws std::runtime_error on wrong types, shapes or numbers, or on a solid that
/// check_solid() refuses.
TetMesh read_solid(const h5::Reader& file);

}  // namespace nbd
