#pragma once

#include <optional>

#include "meshing/tets/tet_complex.hpp"

namespace nbd {

// Changes of a neighbourhood, each the best of its kind by the least radius ratio that it leaves. A ratio
// <= 0 means that the change is not possible. The same input gives the same bits.

/// Removes the edge a-b of tetrahedron `t` and fills the polygon around it (3-2 flip, 4-4 flip and so on). An
/// edge of the boundary or with more than 12 tetrahedra cannot be removed: the result is empty.
/// Source: [FreitagOllivierGooch97].
std::optional<TetChange> remove_edge(const TetComplex& complex, int t, int a, int b);

/// Replaces the face of `t` opposite to its corner `c` by an edge (2-3 flip). The result is empty for a
/// boundary face.
std::optional<TetChange> remove_face(const TetComplex& complex, int t, int c);

/// Moves a node to where its worst tetrahedron is best. The result is empty for a node of the boundary.
std::optional<TetChange> move_node(const TetComplex& complex, int node);

/// Puts a new node into the tetrahedra around the edge a-b of `t`, in place of the edge, and moves it to
/// where its worst tetrahedron is best. The result is empty for an edge of the boundary.
std::optional<TetChange> insert_node(const TetComplex& complex, int t, int a, int b);

/// Lets the new node of such a change take the place of one more tetrahedron after the other, as long as its
/// worst tetrahedron gets better.
TetChange widen(const TetComplex& complex, TetChange change);

}  // namespace nbd
