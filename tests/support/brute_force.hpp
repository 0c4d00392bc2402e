#pragma once

#include <limits>
#include <span>
#include <vector>

#include "collision/geometry/geometry.hpp"

namespace nbd::test {

/// What queries must find, from every face of a surface against every face of another: the definition,
/// without trees. Arguments as of collision/query/one_shot.hpp.

/// Face f of a surface in the pose x.
Triangle face_triangle(const VerticesRef& x, const FacesRef& F, Eigen::Index f);

/// Face pairs that have a point in common, sorted by (a, b).
std::vector<FacePair> brute_force_intersecting(const VerticesRef& xa, const FacesRef& fa,
                                               const VerticesRef& xb, const FacesRef& fb);

/// A copy of the pairs, as they are and in ascending order.
inline std::vector<FacePair> listed(std::span<const FacePair> pairs) { return {pairs.begin(), pairs.end()}; }
std::vector<FacePair> sorted(std::span<const FacePair> pairs);

/// Face pairs at most `distance` metres apart, sorted by (a, b).
std::vector<FacePair> brute_force_within(const VerticesRef& xa, const FacesRef& fa, const VerticesRef& xb,
                                         const FacesRef& fb, float distance);

/// The first of the closest face pairs, and its distance in metres.
struct BruteForceClosest {
    FacePair faces;
    double distance = std::numeric_limits<double>::infinity();
};
BruteForceClosest brute_force_closest(const VerticesRef& xa, const FacesRef& fa, const VerticesRef& xb,
                                      const FacesRef& fb);

}  // namespace nbd::test
