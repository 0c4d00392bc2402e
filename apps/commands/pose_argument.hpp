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
    bool learned = false;                // from a tree file, with whatever bounds that holds
    std::vector<RegionMotion> motion{};  // for `certified` bounds, where the pose has its nodes
};

/// Reads `SURFACE` (a surface file as it stands, exact bounds) or `TREE.h5@POSE`, POSE being a surface file
/// with the tree's faces or `RECORDING.h5:trajectory:frame`. Throws std::runtime_error naming the part that
/// is wrong.
PosedSurface read_pose(const std::string& argument);

}  // namespace nbd
