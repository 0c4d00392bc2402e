#pragma once

#include <Eigen/Core>
#include <array>
#include <string>

#include "collision/geometry/embedding.hpp"
#include "collision/geometry/geometry.hpp"
#include "collision/geometry/tet_mesh.hpp"

namespace nbd {

struct TriMesh {
    Nodes X;  // [n, 3]
    Faces F;  // [m, 3]
};

/// Whether two corners of a face are the same vertex.
inline bool repeats_vertex(const Faces& F, Eigen::Index f) noexcept {
    return F(f, 0) == F(f, 1) || F(f, 1) == F(f, 2) || F(f, 2) == F(f, 0);
}

/// "(x, y, z)" of a vertex, for messages.
std::string place(const TriMesh& mesh, Eigen::Index vertex);

/// Throws std::invalid_argument, naming the first vertex or face, for a vertex that is not finite, an index
/// out of range, and a surface without faces.
void check_arrays(const TriMesh& mesh);

/// Three vertices of a face in ascending order: equal for faces with the same vertices.
std::array<int, 3> sorted_corners(const Faces& F, Eigen::Index f) noexcept;

/// Signed volume of a tetrahedron, m3.
double volume(const TetMesh& tets, Eigen::Index t);

/// Sum of the areas of triangles, m2. F: rows of X.
double area(NodesRef X, FacesRef F);

/// Faces of exactly one tetrahedron, by their corners, oriented outward, sorted by (tet, local face). [b, 3]
/// indices into tets.X.
Faces boundary_faces(const TetMesh& tets);

/// Drops vertices that no face uses and returns their number; the others keep their order. Indices must be
/// in range.
int drop_unreferenced(TriMesh& mesh);

/// The largest distance of a point of a face from the nearest vertex of the face, metres; 0 without faces. A
/// ball of at least this radius whose centre passes through a face holds one of its vertices on the way.
/// In a face without an obtuse angle it is the radius of the circle around it: half the longest edge with a
/// right angle, and the longest edge divided by sqrt(3), the most of all shapes, if all edges are equal.
double vertex_gap(const TriMesh& mesh);

/// Squared distance from p to the closest point of triangle a b c, which may be degenerate. Double precision,
/// for rest poses; collision/ has the exact and fast float32 versions.
double squared_distance_to_triangle(const Eigen::Vector3d& p, const Eigen::Vector3d& a,
                                    const Eigen::Vector3d& b, const Eigen::Vector3d& c) noexcept;

}  // namespace nbd
