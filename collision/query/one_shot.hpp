#pragma once

#include <vector>

#include "collision/query/closest_query.hpp"

namespace nbd {

/// Questions about two surfaces that are asked once. Each call builds two trees, asks the query named below
/// and drops the trees. Surfaces that move are better kept as a PosedTree each, with one PairQuery or
/// ClosestQuery for all frames: building a tree takes many times as long as asking it, and a warm query
/// allocates nothing.
///
/// xa, xb: vertex positions [n, 3] in world space, metres, finite. fa, fb: faces [m, 3], m >= 1. Faces may be
/// degenerate. The surfaces need not be closed. All functions throw std::invalid_argument with one line that
/// names the surface, a or b, and what is wrong with it: no faces, a vertex number out of range, or a
/// position that is not finite or too large.

/// Pairs of faces that have a point in common: the exact set, sorted by (a, b). See
/// PairQuery::intersecting().
std::vector<FacePair> intersecting_faces(VerticesRef xa, FacesRef fa, VerticesRef xb, FacesRef fb);

/// Pairs of faces at most `distance` apart: the exact set, sorted by (a, b). See PairQuery::within().
/// distance: metres, finite, >= 0. Throws std::invalid_argument also on another distance.
std::vector<FacePair> face_pairs_within(VerticesRef xa, FacesRef fa, VerticesRef xb, FacesRef fb,
                                        float distance);

/// The two faces that come closest, the first pair of equally close ones, and their closest points. Of
/// surfaces that intersect: any pair of faces that does, at distance 0. See ClosestQuery::closest().
ClosestFaces closest_points(VerticesRef xa, FacesRef fa, VerticesRef xb, FacesRef fb);

}  // namespace nbd
