#pragma once

#include <vector>

#include "collision/geometry/geometry.hpp"

namespace nbd {

/// All pairs of faces of two surfaces that intersect (distance 0) or lie within a distance, metres, sorted by
/// (a, b). The reference that queries are checked against: it shares nothing with them but the test of two
/// triangles. Compares the boxes of all faces, along one axis after sorting, and asks the triangles of each
/// pair of boxes. xa, xb: positions [n, 3]; fa, fb: faces.
std::vector<FacePair> swept_pairs(VerticesRef xa, FacesRef fa, VerticesRef xb, FacesRef fb, float distance);

}  // namespace nbd
