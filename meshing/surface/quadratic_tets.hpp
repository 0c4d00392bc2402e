#pragma once

#include <array>
#include <optional>
#include <utility>

#include "collision/geometry/tet_mesh.hpp"

namespace nbd {

/// The corners of the edges in TetEdges.
constexpr std::array<std::pair<int, int>, 6> edges_of_tet{{{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}}};

enum class Elements { linear, quadratic };

/// Makes linear tetrahedra quadratic: adds a node in the middle of each edge, in the order of the edges'
/// sorted corners, behind the nodes of the mesh, which keep their numbers as tetrahedra do.
TetMesh make_quadratic(TetMesh linear);

/// The tetrahedra as elements of a kind; without one as they are. Throws std::invalid_argument where
/// quadratic ones should become linear.
TetMesh as_elements(TetMesh mesh, std::optional<Elements> elements);

/// For each corner a of each quadratic tetrahedron, row 4 t + a, the linear one between it and the nodes of
/// its edges, with corners in the order of T: half as large, and of the same shape at rest. Its deformation
/// gradient is that of the quadratic map at the corner, and those in between are the means of the four,
/// weighted with barycentric coordinates. Of linear tetrahedra: T.
Tets corner_tets(const TetMesh& mesh);

/// Nodes 0 to 9 of a tetrahedron, corners first: [T, 10]; of linear ones T, [T, 4].
ElementNodes nodes_of_tets(const TetMesh& mesh);

/// Splits every quadratic tetrahedron into eight linear ones on the same nodes: tetrahedron t becomes 8 t to
/// 8 t + 7. The octahedron that is left between the corners is cut along its shortest diagonal.
TetMesh split(const TetMesh& quadratic);

}  // namespace nbd
