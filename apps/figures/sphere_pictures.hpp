#pragma once

#include <memory>
#include <string>
#include <vector>

#include "apps/drawing/canvas.hpp"
#include "collision/tree/collision_tree.hpp"

namespace nbd {

/// The sphere of a node in one pose.
struct NodeSphere {
    BoundKind bound = BoundKind::exact;
    int depth = 0, node = 0;
    Sphere sphere;
    int outside = 0;  // of the node's vertices
};

/// Spheres of all nodes at depths 1, 3, 5, 7, as far down as the tree goes, of each bound, without margins.
/// x: pose, [vertex_count, 3]. Throws as PosedTree where the tree lacks a bound.
std::vector<NodeSphere> spheres_in_pose(const std::shared_ptr<const CollisionTree>& tree, VerticesRef x,
                                        const std::vector<BoundKind>& bounds);

/// The paper's figures 9 to 11: a row of pictures a bound, a column a depth. The body is seen through its
/// spheres; faces with a vertex outside are red. spheres: as spheres_in_pose() gives them.
Page sphere_page(const std::string& title, const CollisionTree& tree, VerticesRef x,
                 const std::vector<NodeSphere>& spheres);

/// One line a sphere under a line of column names; metres.
std::string to_csv(const std::vector<NodeSphere>& spheres);

}  // namespace nbd
