#include "collision/bounds/certified/certified_bound.hpp"

#include <algorithm>
#include <cmath>

#include "collision/bounds/certified/squared_norm.hpp"
#include "collision/geometry/bounding_sphere.hpp"

namespace nbd {

static_assert(Bound<CertifiedBound>);

CertifiedBound::CertifiedBound(const SphereTree& tree, const CertifiedModel& model)
    : tree_(&tree), model_(&model), pairs_(model.pairs.size()) {
    int most = 0;
    for (std::size_t i = 0; i < tree.nodes.size(); ++i)
        most = std::max(most, model.cell_begin[i + 1] - model.cell_begin[i]);
    blocks_.resize(static_cast<std::size_t>((most + lanes - 1) / lanes));
}

void CertifiedBound::begin_pose(const Positions& x, std::span<const RegionMotion> motion) noexcept {
    x_ = x;
    motion_ = motion;
    max_stretch_ = 0;
    for (const RegionMotion& m : motion) max_stretch_ = std::max(max_stretch_, m.stretch);
    ++pose_;
}

Eigen::Vector3f CertifiedBound::position(int vertex) const noexcept {
    x_.require(std::span(&vertex, 1));
    return x_.point(vertex);
}

/// Bound on |F - G| in the second region of a pair, for the G of the pair's carrier.
float CertifiedBound::pair_deviation(int pair) noexcept {
    PairDeviation& known = pairs_[static_cast<std::size_t>(pair)];
    if (known.pose == pose_) return known.value;
    const auto [carrier, other] = model_->pairs[static_cast<std::size_t>(pair)];
    const RegionMotion& m = motion_[static_cast<std::size_t>(other)];
    known = {pose_, m.deviation};
    if (carrier == other) return known.value;
    const Eigen::Matrix3f difference = m.G - motion_[static_cast<std::size_t>(carrier)].G;
    using One = Eigen::Array<float, 1, 1>;
    std::array<One, 9> entries;
    for (std::size_t k = 0; k < 9; ++k) entries[k][0] = difference.data()[k];
    return known.value += std::sqrt(squared_norm_bound(entries)[0]);
}

void CertifiedBound::place(const CertifiedModel::Cell& cell, const Eigen::Vector3f& origin, Block& block,
                           int lane) noexcept {
    const Eigen::Matrix3f& G = motion_[static_cast<std::size_t>(cell.carrier)].G;
    const Eigen::Vector3f anchor = position(cell.anchor) - origin, centre = anchor + G * cell.m;
    const Eigen::Matrix3f M = G * cell.B;
    // The smaller of two bounds counts: one takes the worst region for the whole path, the other each region
    // for its part.
    float worst_stretch = 0, worst_deviation = 0, stretch = 0, deviation = 0;
    for (int k = cell.leg_begin; k < cell.leg_end; ++k) {
        const auto [pair, length] = model_->legs[static_cast<std::size_t>(k)];
        const int other = model_->pairs[static_cast<std::size_t>(pair)].other;
        const float own = motion_[static_cast<std::size_t>(other)].stretch, off = pair_deviation(pair);
        worst_stretch = std::max(worst_stretch, own);
        worst_deviation = std::max(worst_deviation, off);
        stretch += length * own;
        deviation += length * off;
    }
    block.weight[lane] = cell.weight;
    block.straight[lane] = cell.path > 0 ? std::min(stretch, worst_stretch * cell.path) : 0;
    block.carried[lane] = cell.path > 0 ? std::min(deviation, worst_deviation * cell.path) : 0;
    for (std::size_t k = 0; k < 3; ++k) {
        block.anchor[k][lane] = anchor[static_cast<Eigen::Index>(k)];
        block.centre[k][lane] = centre[static_cast<Eigen::Index>(k)];
    }
    for (std::size_t k = 0; k < 9; ++k) block.M[k][lane] = M.data()[k];
}

// Starts at the weighted mean and steps towards the cell that reaches out farthest. The steps approach the
// centre of the smallest ball around the cells [BadoiuClarkson03]; the best centre is returned.
Eigen::Vector3f CertifiedBound::centre(std::span<const Block> blocks) const noexcept {
    Eigen::Vector3f sum = Eigen::Vector3f::Zero();
    float weight = 0;
    for (const Block& block : blocks) {
        weight += block.weight.sum();
        for (std::size_t k = 0; k < 3; ++k)
            sum[static_cast<Eigen::Index>(k)] += (block.weight * block.centre[k]).sum();
    }
    Eigen::Vector3f c = sum / weight, best = c;
    float least = std::numeric_limits<float>::infinity();
    constexpr int steps = 12;
    for (int step = 1; step <= steps; ++step) {
        float reach = -1;
        Eigen::Vector3f away = Eigen::Vector3f::Zero();
        for (const Block& block : blocks) {
            const Lanes x = block.centre[0] - c.x(), y = block.centre[1] - c.y(), z = block.centre[2] - c.z();
            const Lanes distance =
                (x.square() + y.square() + z.square()).sqrt() + block.straight.min(block.carried);
            Eigen::Index lane = 0;
            if (const float farthest = distance.maxCoeff(&lane); farthest > reach) {
                reach = farthest;
                away = {x[lane], y[lane], z[lane]};
            }
        }
        if (reach < least) {
            least = reach;
            best = c;
        }
        c += away / static_cast<float>(step + 1);
    }
    return best;
}

float CertifiedBound::radius(std::span<const Block> blocks, const Eigen::Vector3f& c) const noexcept {
    Lanes most = Lanes::Zero();
    for (const Block& block : blocks) {
        const auto& M = block.M;
        const Lanes ax = block.anchor[0] - c.x(), ay = block.anchor[1] - c.y(), az = block.anchor[2] - c.z();
        const Lanes px = block.centre[0] - c.x(), py = block.centre[1] - c.y(), pz = block.centre[2] - c.z();
        const Lanes straight = (ax.square() + ay.square() + az.square()).sqrt() + block.straight;
        // |M^T p| from the direction of p, so that squares of squares do not underflow.
        const Lanes squared = px.square() + py.square() + pz.square(), p = squared.sqrt(),
                    per_p = (p + std::numeric_limits<float>::min()).inverse();
        const Lanes nx = px * per_p, ny = py * per_p, nz = pz * per_p;
        const Lanes u = M[0] * nx + M[1] * ny + M[2] * nz, v = M[3] * nx + M[4] * ny + M[5] * nz,
                    w = M[6] * nx + M[7] * ny + M[8] * nz;
        const Lanes slope = (u.square() + v.square() + w.square()).sqrt();
        const Lanes carried = (squared + 2 * p * slope + squared_norm_bound(M)).sqrt() + block.carried;
        most = most.max(straight.min(carried));
    }
    return most.maxCoeff();
}

Sphere CertifiedBound::bound(int node) noexcept {
    if (motion_.empty()) {
        x_.require(tree_->node_vertices(node));
        return bounding_sphere(x_.rows(), tree_->node_vertices(node));
    }
    const auto begin = static_cast<std::size_t>(model_->cell_begin[static_cast<std::size_t>(node)]),
               end = static_cast<std::size_t>(model_->cell_begin[static_cast<std::size_t>(node) + 1]);
    const Eigen::Vector3f origin = position(model_->cells[begin].anchor);
    const std::span<Block> blocks = std::span(blocks_).first((end - begin + lanes - 1) / lanes);
    for (std::size_t i = 0; i < lanes * blocks.size(); ++i) {
        Block& block = blocks[i / lanes];
        const auto lane = static_cast<int>(i % lanes);
        place(model_->cells[std::min(begin + i, end - 1)], origin, block, lane);
        if (begin + i >= end) block.weight[lane] = 0;
    }
    const Eigen::Vector3f c = origin + centre(blocks);
    constexpr float factor = 1 + 256 * std::numeric_limits<float>::epsilon(), underflow = 1e-18f;
    const float r = radius(blocks, c - origin) * factor + underflow;
    const float reach = model_->reach > 0 ? model_->reach * max_stretch_ : 0;
    return {c, r + model_->rounding * (c.cwiseAbs().maxCoeff() + r + reach)};
}

}  // namespace nbd
