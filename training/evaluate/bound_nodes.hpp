#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "collision/tree/collision_tree.hpp"

namespace nbd {

/// A node of a tree in a pose: its bound beside the exact one. A box counts as the sphere around its middle
/// with half its diagonal as the radius.
struct BoundNode {
    int level = 0;  // depth in a sphere tree; clusters, blocks and leaves of a wide tree are 0, 1, 2
    int bound = 0;  // nodes that share a margin follow each other and have one number
    bool out_of_range = false;  // bounded exactly because its input is
    Sphere sphere{}, exact{};
    double inflation = 0;  // size / exact size - 1
    long vertices = 0;     // of a wide tree, one counts once for each leaf that has it
};

/// The bounds of all nodes of a tree, pose by pose: what evaluation and coverage measure.
class BoundNodes {
 public:
    virtual ~BoundNodes() = default;

    virtual int levels() const = 0;
    /// All nodes, in the order of their bounds; valid until the next call. exact: exact_spheres() of the pose
    /// for trees that have them.
    virtual std::span<const BoundNode> pose(VerticesRef x, std::span<const Sphere> exact) = 0;
    /// For each factor, how many vertices of node i of the last pose its bound leaves outside, scaled by the
    /// factor about its centre. x: of that pose. Valid until the next call.
    virtual std::span<const long> outside(std::size_t i, VerticesRef x, std::span<const double> factors) = 0;
};

/// Nodes of the sphere tree, or of the wide tree for `learned_affine`. margin: as PosedTree takes it. tree:
/// has such bounds.
std::unique_ptr<BoundNodes> bound_nodes(std::shared_ptr<const CollisionTree> tree, BoundKind kind,
                                        std::optional<float> margin);

/// The exact spheres of a sphere tree's nodes in a pose.
void exact_spheres(const SphereTree& tree, VerticesRef x, std::vector<Sphere>& spheres);

}  // namespace nbd
