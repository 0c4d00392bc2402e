#include "collision/neighbours/neighbour_proof.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

#include "collision/base/message.hpp"
#include "collision/neighbours/local_map.hpp"

namespace nbd {
namespace {

constexpr int leaves_a_task = 16;

/// Covers the rounding of double precision in what is computed here, over the size of the region and its
/// distance from the origin.
constexpr double rounding = 1e-11;

/// The map that follows the points x best, by least squares.
LocalMap fit(const RestNeighbours& rest, int leaf, const LocalPoints& Z, const TermMatrix& T,
             const LocalPoints& x) {
    LocalMap moments = x.lazyProduct(T.transpose());
    for_each_normal(rest.tree(), leaf, Z, [&](const MapTerms& slopes, double weight, int p, int q, int r) {
        moments += weight * unit_normal(x.col(p), x.col(q), x.col(r)) * slopes.transpose();
    });
    return moments * rest.region(leaf).fit;
}

/// Largest distance of one of the first `count` points from any, at most.
double widest(const LocalPoints& u, Eigen::Index count) {
    const auto first = u.leftCols(count);
    const Eigen::Array3d lo = u.rowwise().minCoeff(), hi = u.rowwise().maxCoeff(),
                         first_lo = first.rowwise().minCoeff(), first_hi = first.rowwise().maxCoeff();
    return (hi - first_lo).max(first_hi - lo).matrix().norm();
}

}  // namespace

NeighbourProof::NeighbourProof(std::shared_ptr<const RestNeighbours> rest)
    : rest_(std::move(rest)), proved_(rest_->tree().leaves(), 0) {}

void NeighbourProof::prove(const Nodes& x, const Nodes& motion, const Reach& reach, const Executor& run) {
    const WideTree& tree = rest_->tree();
    std::ranges::fill(proved_, std::uint8_t{0});
    reach_ = reach;
    for (const Nodes* given : {&x, &motion})
        if (given->rows() != tree.vertex_count && (given == &x || given->rows() > 0))
            throw std::invalid_argument(message(given == &x ? "positions: " : "motions: ", given->rows(),
                                                " rows, but the surface has ", tree.vertex_count,
                                                " vertices"));
    const auto for_each_leaf = [&](const auto& work) {
        run((tree.leaves() + leaves_a_task - 1) / leaves_a_task, [&](int task) {
            for (int leaf = task * leaves_a_task; leaf < std::min((task + 1) * leaves_a_task, tree.leaves());
                 ++leaf)
                work(leaf);
        });
    };
    constexpr double infinite = std::numeric_limits<double>::infinity();
    const Eigen::AlignedBox3d everywhere(Eigen::Vector3d::Constant(-infinite),
                                         Eigen::Vector3d::Constant(infinite));
    motions_.assign(motion.rows() > 0 ? static_cast<std::size_t>(tree.leaves()) : 0, {});
    if (motion.rows() > 0)
        for_each_leaf([&](int leaf) {
            Eigen::AlignedBox3d& box = motions_[leaf];
            for (const int vertex : tree.leaf_vertices(leaf)) {
                if (motion.row(vertex).allFinite())
                    box.extend(motion.row(vertex).transpose());
                else
                    box.extend(everywhere);
            }
        });
    try {
        for_each_leaf([&](int leaf) { proved_[leaf] = is_proved(leaf, x); });
    } catch (...) {
        std::ranges::fill(proved_, std::uint8_t{0});
        throw;
    }
}

double NeighbourProof::relative_motion(int leaf_a, int leaf_b) const noexcept {
    if (motions_.empty()) return 0;
    const Eigen::AlignedBox3d &a = motions_[leaf_a], &b = motions_[leaf_b];
    return (a.max() - b.min()).cwiseMax(b.max() - a.min()).norm();
}

/// Rest positions are the region's points, as they are stored. Let q be the fitted map and u = x - q at the
/// vertices. Points of two faces with corners i and j and weights a_i and b_j at rest X, Y are sum a_i x_i -
/// sum b_j x_j = [sum a_i q_i - sum b_j q_j] + sum a_i b_j (u_i - u_j) apart. The sum of the u is no longer
/// than the longest u_i - u_j. The bracket is q(X) - q(Y) but for the error of linear interpolation on each
/// face, at most half the second derivative times the squared radius of the smallest disc around it, which is
/// at most a third of its longest edge squared. So the points are at least
///     stretch * distance - |u_i - u_j| - longest_edge^2 * bend / 3
/// apart.
bool NeighbourProof::is_proved(int leaf, const Nodes& x) const {
    const RestNeighbours::Region region = rest_->region(leaf);
    if (region.covered.empty()) return false;
    const Eigen::Index own = rest_->tree().leaf_vertices(leaf).size();
    const LocalPoints Z = local_points(region.points);
    const Eigen::Vector3d origin = x.row(region.vertices.front());
    LocalPoints u = local_points(x, region.vertices, origin, region.size);
    const TermMatrix T = terms(Z);
    const LocalMap q = fit(*rest_, leaf, Z, T, u);
    const MapBound bound = bound_of(q, region.half);
    if (!(bound.stretch > 0)) return false;
    u -= q.lazyProduct(T);
    double moved = 0;
    for (const RestNeighbours::Covered& covered : region.covered)
        moved = std::max(moved, relative_motion(leaf, covered.leaf));
    const double edge = region.longest_edge / region.size,
                 off = region.size * (widest(u, own) + edge * edge * bound.bend / 3),
                 slack = rounding * (region.size + origin.norm() + region.centre.norm()),
                 least = bound.stretch * region.distance - off - slack;
    return least > reach_.inside && least > reach_.apart + std::min(reach_.approach, moved + slack);
}

int NeighbourProof::leaves() const noexcept {
    return std::ranges::count_if(tree().faces_in, [](std::uint8_t faces) { return faces > 0; });
}

int NeighbourProof::proved() const noexcept { return std::ranges::count(proved_, std::uint8_t{1}); }

}  // namespace nbd
