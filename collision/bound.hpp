#pragma once

#include <concepts>

#include "collision/geometry.hpp"

namespace nbd {

/// A way to bound the nodes of a sphere tree in any pose, world space. begin_pose() sees every pose first;
/// bound() is then asked for nodes in no particular order, at most once each. Neither throws or allocates.
template <class B>
concept Bound = requires(B bounds, VerticesRef x, int node) {
    bounds.begin_pose(x);
    { bounds.bound(node) } -> std::same_as<Sphere>;
};

/// A bound that knows what it was trained on. strangeness() of the node that bound() was asked for last: how
/// far its input lies from those of the training, 0 or more, about 1 at the edge of their range, not a number
/// where the input is none. Above a limit that calibration sets, the node is bounded exactly instead.
template <class B>
concept GatedBound = Bound<B> && requires(B bounds, int node) {
    { bounds.strangeness(node) } -> std::same_as<float>;
};

}  // namespace nbd
