#pragma once

#include <memory>
#include <string>
#include <vector>

#include "collision/tree/collision_tree.hpp"

namespace nbd {

/// A body in a pose, as the command line names it.
struct PosedSurface {
    std::shared_ptr<const CollisionTree> tree;
    Vertices x;                          // [n, 3]
    bool from_tree = false;              // with the bounds of a tree file
    Vertices nodes{};                    // [N, 3] that carry the surface; empty if the pose has none
    std::vector<RegionMotion> motion{};  // for `certified` bounds; empty if the pose has no nodes
};

/// Reads `SURFACE` (a surface file, with exact bounds) or `TREE.h5@POSE`, where POSE is a surface file with
/// the tree's faces or `RECORDING.h5:trajectory:frame`. bounds: those that a tree is to be used with;
/// `affine` needs a recorded pose. For these, and for `auto` where the pose has nodes, the tree gets its
/// affine model. Throws std::runtime_error that names the wrong part.
PosedSurface read_pose(const std::string& argument, BoundKind bounds);

}  // namespace nbd
