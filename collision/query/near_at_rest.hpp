#pragma once

#include <memory>

#include "collision/geometry/face_pair_set.hpp"

namespace nbd {

/// The pairs of faces that are at most `distance` apart in the rest pose and share no vertex. A SelfQuery
/// that leaves them out reports only faces that came near each other since. X: rest positions [n, 3];
/// F: faces [m, 3]; distance: metres, finite, >= 0. Throws std::invalid_argument as intersecting_faces(), and
/// on a distance out of range.
std::shared_ptr<const FacePairSet> near_at_rest(VerticesRef X, FacesRef F, float distance);

}  // namespace nbd
