#pragma once

#include <vector>

#include "collision/nbd_tree/sphere_tree.hpp"

namespace nbd {

/// Bounding spheres of all nodes, computed bottom-up from the vertices in each pose; equal to
/// bounding_sphere() up to rounding. Each sphere contains its node's vertices. Cost: one gather of the
/// vertices, then one distance per vertex and level.
class ExactBound {
 public:
    /// tree: must outlive this object.
    explicit ExactBound(const SphereTree& tree);
    void begin_pose(VerticesRef x) noexcept;
    Sphere bound(int node) const noexcept { return spheres_[node]; }

    /// Whether a position of this pose was not finite, which the root's sphere shows, or it overflows.
    bool met_non_finite() const noexcept { return !(0 * (spheres_[0].c.sum() + spheres_[0].r) == 0); }

 private:
    static constexpr int lanes = 16;
    using Lanes = Eigen::Array<float, lanes, 1>;
    /// Positions of 16 vertices of a leaf. The last block of a leaf repeats the leaf's first vertex.
    struct Block {
        Lanes x, y, z;
    };
    struct Leaf {
        int node;
        std::size_t block_begin, block_end;
    };

    void gather(VerticesRef x) noexcept;
    void add_up_centres() noexcept;
    void measure_radii() noexcept;

    const SphereTree* tree_;
    std::vector<int> parents_;  // [nodes], -1 at the root
    std::vector<Leaf> leaves_;
    std::vector<int> rows_;  // [blocks * lanes] vertex of each lane
    std::vector<Block> blocks_;
    std::vector<Eigen::Vector3d> sums_;  // [nodes] sum of the positions in the node's vertex list
    std::vector<Lanes> squared_;         // [nodes] largest squared distance from the centre, lane by lane
    std::vector<Sphere> spheres_;        // [nodes]
};

}  // namespace nbd
