#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "collision/bounds/bound.hpp"
#include "collision/bounds/certified/certified_model.hpp"
#include "collision/geometry/positions.hpp"

namespace nbd {

/// Spheres that contain all vertices of their node in every pose whatever, from a few vertices and bounds on
/// the deformation gradients. Reads the anchors of a pose alone; without motions, the exact sphere.
///
/// Proof. Positions are continuous and affine in each tetrahedron, so along a path inside the solid from an
/// anchor a to a vertex v of its cell x_v - x_a is the sum of F_t dX over the path's pieces, F_t the gradient
/// of the tetrahedron that a piece lies in. A vertex that hangs on nodes of several tetrahedra by weights is
/// the weighted sum of such paths, and counts with the weighted sum of their lengths. Let the path run l_R
/// metres through region R, l in all. Then for any matrix G
///   |x_v - x_a - G (X_v - X_a)| <= sum_R l_R max_R |F - G| <= l max_R |F - G|,
/// where max_R |F - G| <= max_R |F - G_R| + |G_R - G|. Call e(G) the smaller of the two right-hand sides with
/// every l_R and l replaced by the longest of the cell's paths. X_v - X_a = m + B w with |w| <= 1, so for any
/// centre c, with p = x_a + G m - c and M = G B,
///   |x_v - c| <= |p + M w| + e(G) <= sqrt(|p|^2 + 2 |M^T p| + |M|^2) + e(G).
/// The radius is the largest over the cells of the smaller of this for the G of the cell's carrier, and for
/// G = 0, where it says |x_a - c| plus stretch times length. Nothing depends on the choice of c, which goes
/// for a small radius.
/// Rounding. All lengths here are differences of positions in the node, so at most 2 r; each result is off by
/// less than 100 float32 roundings of such lengths, 2^-15 r covers them, and 1e-18 m what underflows.
/// Positions themselves are off by model.rounding |x|_inf, and |x|_inf <= |c|_inf + r + reach max |F| for the
/// vertex and all that it hangs on; the last term of the radius covers that for v and a. Gradients are known
/// in double precision: their error, about 2^-50 |x| / h in a tetrahedron of height h, is below that too
/// unless l > 10^6 h.
class CertifiedBound {
 public:
    /// tree and model: referred to.
    CertifiedBound(const SphereTree& tree, const CertifiedModel& model);

    /// motion: one a region, or none. x and motion: referred to until the next call, x alone longer.
    void begin_pose(const Positions& x, std::span<const RegionMotion> motion = {}) noexcept;
    Sphere bound(int node) noexcept;

 private:
    static constexpr int lanes = 16;
    using Lanes = Eigen::Array<float, lanes, 1>;
    /// Cells of a node in this pose, positions relative to the node's first anchor. The last block repeats
    /// the last cell.
    struct Block {
        Lanes weight, straight, carried;      // weight; the last terms of (1) and (2)
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
    std::vector<PairDeviation> pairs_;  // [pairs] computed when first asked for in a pose
    std::vector<Block> blocks_;         // scratch
};

}  // namespace nbd
