#pragma once

#include <concepts>

#include "collision/geometry/box.hpp"
#include "collision/geometry/geometry.hpp"

namespace nbd {

/// A way to bound the nodes of a sphere tree in any pose, world space. begin_pose() sees every pose first;
/// bound() is then asked for nodes in no particular order, at most once each. Neither throws or allocates.
template <class B>
concept Bound = requires(B bounds, VerticesRef x, int node) {
    bounds.begin_pose(x);
    { bounds.bound(node) } -> std::same_as<Sphere>;
};

/// A bound whose volumes are axis-aligned boxes; bound() is then the sphere around one.
template <class B>
concept BoxBound = Bound<B> && requires(B bounds, int node) {
    { bounds.box(node) } -> std::convertible_to<Box>;
};

/// A bound that knows what it was trained on. ood_score() of the node that bound() was asked for last: how
/// far its input lies from the midst of the training's, 0 or more, in any unit, not a number where the input
/// is none; always 0 for a node that is exact whatever the pose. Calibrated margins grow with it, and above a
/// limit that calibration sets the node is bounded exactly instead. The better it tells easy poses from hard
/// ones, the smaller margins are.
template <class B>
concept GatedBound = Bound<B> && requires(B bounds, int node) {
    { bounds.ood_score(node) } -> std::same_as<float>;
};

/// What a calibrated margin is multiplied by: 1 at the limit, little in the midst of what is known.
inline float margin_weight(float ood_score, float limit) noexcept {
    return limit > 0 ? 0.03f + 0.97f * ood_score / limit : 1;
}

}  // namespace nbd
