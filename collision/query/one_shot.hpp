#pragma once

#include <vector>

#include "collision/geometry/tet_mesh.hpp"
#include "collision/query/closest_query.hpp"

namespace nbd {

/// One-time queries between two surfaces. Each call builds two trees, runs one query and discards the trees.
/// For surfaces that move, keep a PosedTree for each and one PairQuery or ClosestQuery for all frames:
/// building a tree takes many times as long as a query, and a warm query allocates nothing.
///
/// xa, xb: vertex positions [n, 3] in world space, metres, finite. fa, fb: faces [m, 3], m >= 1. Faces may be
/// degenerate. The surfaces need not be closed. All functions throw std::invalid_argument with one line that
/// names the surface, a or b, and what is wrong with it: no faces, a vertex index out of range, or a position
/// that is not finite or too large.

/// Positions in double precision may lie far from zero, as geographic coordinates do: both surfaces are
/// counted from a common origin near them, see far_origin(), before they become float32. Pairs are then those
/// of the same surfaces near zero.

/// Pairs of faces that have a point in common: the exact set, sorted by (a, b). See
/// PairQuery::intersecting().
std::vector<FacePair> intersecting_faces(VerticesRef xa, FacesRef fa, VerticesRef xb, FacesRef fb);
std::vector<FacePair> intersecting_faces(NodesRef xa, FacesRef fa, NodesRef xb, FacesRef fb);

/// Pairs of faces at most `distance` apart: the exact set, sorted by (a, b). See PairQuery::within().
/// distance: metres, finite, >= 0; throws std::invalid_argument on any other.
std::vector<FacePair> face_pairs_within(VerticesRef xa, FacesRef fa, VerticesRef xb, FacesRef fb,
                                        float distance);
std::vector<FacePair> face_pairs_within(NodesRef xa, FacesRef fa, NodesRef xb, FacesRef fb, float distance);

/// The closest pair of faces, the first of equally close pairs, and their closest points. If the surfaces
/// intersect, this is any intersecting pair, at distance 0. See ClosestQuery::closest().
ClosestFaces closest_points(VerticesRef xa, FacesRef fa, VerticesRef xb, FacesRef fb);
ClosestFaces closest_points(NodesRef xa, FacesRef fa, NodesRef xb, FacesRef fb);

}  // namespace nbd
