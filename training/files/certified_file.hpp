#pragma once

#include "collision/bounds/certified/certified_model.hpp"
#include "collision/geometry/tet_mesh.hpp"
#include "meshing/h5/reader.hpp"
#include "meshing/h5/writer.hpp"

namespace nbd {

/// The group `certified` of a tree file. Reading throws std::runtime_error on wrong types, shapes or numbers;
/// check_certified_model() sees to the rest.
void write_certified(h5::Writer& file, const CertifiedModel& model);
CertifiedModel read_certified(const h5::Reader& file, std::size_t nodes);

/// The group `solid`: the tetrahedra that move the surface.
void write_solid(h5::Writer& file, const TetMesh& solid);
/// Throws std::runtime_error on a bad solid as well.
TetMesh read_solid(const h5::Reader& file);

}  // namespace nbd
