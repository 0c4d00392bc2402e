#pragma once

#include <memory>
#include <string>
#include <vector>

#include "apps/drawing/image.hpp"
#include "collision/tree/collision_tree.hpp"

namespace nbd {

/// The sphere of a node in one pose.
struct NodeSphere {
    BoundKind bound = BoundKind::exact;
    int depth = 0, node = 0;
    Sphere sphere;
    int outside = 0;  // number of the node's vertices outside
};

/// Spheres of all nodes at depths 1, 3, 5 and 7 (where the tree has them), for each bound, without margins.
/// x: pose, [vertex_count, 3]. Throws what PosedTree throws if the tree lacks a bound.
std::vector<NodeSphere> spheres_in_pose(const std::shared_ptr<const CollisionTree>& tree, VerticesRef x,
                                        const std::vector<BoundKind>& bounds);

/// The paper's figures 9 to 11: a row of square tiles for each kind of bounds, a column for each depth.
struct SpherePictures {
    std::string title;
    std::vector<std::string> labels;  // of the rows
    Image tiles;
};

/// Draws the spheres of spheres_in_pose(). The body shows through its spheres; faces with a vertex outside
/// are red.
SpherePictures draw_spheres(const std::string& title, const CollisionTree& tree, VerticesRef x,
                            const std::vector<NodeSphere>& spheres);

/// CSV: column names, then one line per sphere; metres.
std::string to_csv(const std::vector<NodeSphere>& spheres);

}  // namespace nbd
