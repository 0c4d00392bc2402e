#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "collision/bounds/bound.hpp"
#include "collision/bounds/certified/certified_model.hpp"
#include "collision/geometry/positions.hpp"

namespace nbd {

/// Spheres that contain all vertices of their node in every pose, from a few vertices and bounds on the
/// deformation gradients. Reads only the anchors of a pose; without motions it returns the exact sphere.
///
/// Proof. Positions are continuous, and affine in each tetrahedron. So along a path inside the solid from an
/// anchor a to a vertex v of its cell, x_v - x_a is the sum of F_t dX over the path's pieces, where F_t is
/// the gradient of the tetrahedron around a piece. For a vertex that depends on nodes of several tetrahedra
/// it is a weighted sum over such paths, whose lengths add up with the same weights. Let the path run l_R
/// metres through region R, l in all. Then for any matrix G
///   |x_v - x_a - G (X_v - X_a)| <= sum_R l_R max_R |F - G| <= l max_R |F - G|,
/// where max_R |F - G| <= max_R |F - G_R| + |G_R - G|. Let e(G) be the smaller of the two right-hand sides,
/// with every l_R and l replaced by its maximum over the cell's paths. X_v - X_a = m + B w with |w| <= 1, so
/// for any centre c, with p = x_a + G m - c and M = G B,
///   |x_v - c| <= |p + M w| + e(G) <= sqrt(|p|^2 + 2 |M^T p| + |M|^2) + e(G).
/// Each cell takes the smaller of two such bounds: for the G of its carrier, and for G = 0, where the bound
/// is |x_a - c| plus stretch times length. The radius is the largest over the cells. The proof holds for any
/// c, which is chosen for a small radius.
///
/// Rounding. All lengths here are differences of positions in the node, so at most 2 r. Each result is off by
/// less than 100 float32 roundings of such lengths; 2^-15 r covers them, and 1e-18 m covers underflow.
/// Positions are off by model.rounding |x|_inf, and |x|_inf <= |c|_inf + r + reach max |F| for the vertex and
/// all nodes that it depends on; the last term of the radius covers that for v and a. Gradients are known in
/// double precision: their error, about 2^-50 |x| / h in a tetrahedron of height h, is also below that unless
/// l > 10^6 h.
class CertifiedBound {
 public:
    /// tree, model: must outlive this object.
    CertifiedBound(const SphereTree& tree, const CertifiedModel& model);

    /// motion: one per region, or empty. x, motion: must stay valid until the next call.
    void begin_pose(const Positions& x, std::span<const RegionMotion> motion = {}) noexcept;
    Sphere bound(int node) noexcept;

 private:
    static constexpr int lanes = 16;
    using Lanes = Eigen::Array<float, lanes, 1>;
    /// Cells of a node in this pose, with positions relative to the node's first anchor. Unused lanes of the
    /// last block repeat the last cell with weight 0.
    struct Block {
        Lanes weight, straight, carried;      // weight; e(0); e(G) for the carrier's G
        std::array<Lanes, 3> anchor, centre;  // x_a; x_a + G m
        std::array<Lanes, 9> M;               // column by column
    };

    Eigen::Vector3f position(int vertex) const noexcept;
    float pair_deviation(int pair) noexcept;
    void place(const CertifiedModel::Cell& cell, const Eigen::Vector3f& origin, Block& block,
               int lane) noexcept;
    Eigen::Vector3f centre(std::span<const Block> blocks) const noexcept;
    float radius(std::span<const Block> blocks, const Eigen::Vector3f& c) const noexcept;

    struct PairDeviation {
        std::uint64_t pose = 0;
        float value = 0;
    };

    const SphereTree* tree_;
    const CertifiedModel* model_;
    Positions x_;
    std::span<const RegionMotion> motion_;
    float max_stretch_ = 0;
    std::uint64_t pose_ = 0;
    std::vector<PairDeviation> pairs_;  // [pairs] computed on first use in a pose
    std::vector<Block> blocks_;         // scratch
};

}  // namespace nbd
