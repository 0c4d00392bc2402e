#pragma once

#include <Eigen/Core>

#include "collision/geometry/embedding.hpp"
#include "collision/geometry/geometry.hpp"
#include "collision/geometry/tet_mesh.hpp"

namespace nbd {

struct TriMesh {
    Nodes X;  // [n, 3]
    Faces F;  // [m, 3]
};

/// Faces of exactly one tetrahedron, oriented outward, sorted by (tet, local face). [b, 3] indices into
/// tets.X.
Faces boundary_faces(const TetMesh& tets);

}  // namespace nbd
