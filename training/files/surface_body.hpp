#pragma once

#include <Eigen/Core>
#include <string>

#include "collision/geometry/embedding.hpp"
#include "collision/geometry/geometry.hpp"
#include "collision/geometry/tet_mesh.hpp"
#include "collision/tree/collision_tree.hpp"

namespace nbd {

/// Modes on a surface, [3 n, m], vertex-major and row-major. Rows 3 v .. 3 v + 2 of vertex v are contiguous,
/// so the same memory is also the [n, 3 m] matrix whose rows are clustered.
using ModeRows = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// A body as training needs it: its collision surface and how recorded node positions move it.
struct SurfaceBody {
    Vertices X;          // [n, 3] rest positions, metres
    Faces F;             // [f, 3]
    SurfaceEmbedding W;  // [n, N]
    ModeRows U;          // [3 n, m], m may be 0
    std::string hash;    // body_hash() of the body
    TetMesh solid{};     // tetrahedra of the nodes; may be empty
};

/// Builds a body, interpolating node_modes, [3 N, m], node-major, to the surface. Throws
/// std::invalid_argument on mismatched shapes or a non-finite number.
SurfaceBody make_surface_body(VerticesRef X, FacesRef F, const SurfaceEmbedding& W,
                              Eigen::Ref<const Eigen::MatrixXf> node_modes, std::string hash);

/// Gives a tree of the body's surface `affine` bounds. Without tetrahedra, whose nodes have the rest
/// positions, or with weights that cannot bound, it gets none; a notice says why in the second case.
void hang_on_solid(CollisionTree& tree, const SurfaceBody& body);

}  // namespace nbd
