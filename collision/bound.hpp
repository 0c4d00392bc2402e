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

}  // namespace nbd
