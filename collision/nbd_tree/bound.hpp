#pragma once

#include <concepts>

#include "collision/geometry/geometry.hpp"

namespace nbd {

/// Bounds the nodes of a sphere tree in any pose, in world space. begin_pose() is called first for each pose,
/// then bound() for nodes in any order; a repeated call gives the same. Neither throws or allocates.
template <class B>
concept Bound = requires(B bounds, const Vertices& x, int node) {
    bounds.begin_pose(x);
    { bounds.bound(node) } -> std::same_as<Sphere>;
};

/// A bound with an out-of-distribution score. ood_score() refers to the node of the last call of bound(): how
/// far its input lies from the centre of the training inputs, >= 0, in any unit; NaN for NaN input; always 0
/// for a node that is exact in every pose. Calibrated margins grow with the score, and above a calibrated
/// limit the node is bounded exactly instead. The better the score separates easy poses from hard ones, the
/// smaller the margins.
template <class B>
concept GatedBound = Bound<B> && requires(B bounds, int node) {
    { bounds.ood_score(node) } -> std::same_as<float>;
};

}  // namespace nbd
