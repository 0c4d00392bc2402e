#pragma once

#include <string_view>

#include "collision/tree/collision_tree.hpp"
#include "meshing/body/body.hpp"

namespace nbd {

/// Gives a tree over the body's surface `affine` bounds, which hang on the body's nodes, where its weights
/// allow them; a notice that begins with `name` says why not. Without them `auto` bounds are boxes.
void hang_on_body(CollisionTree& tree, const Body& body, std::string_view name);

}  // namespace nbd
