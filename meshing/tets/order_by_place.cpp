#include "meshing/tets/order_by_place.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <vector>

namespace nbd {
namespace {

constexpr int bits = 20;  // of the grid, for each axis

/// Puts two zeros behind each bit.
std::uint64_t spread(std::uint64_t x) noexcept {
    std::uint64_t code = 0;
    for (int b = 0; b < bits; ++b) code |= (x >> b & 1) << (3 * b);
    return code;
}

std::vector<std::uint64_t> morton_codes(const Nodes& X) {
    const Eigen::RowVector3d low = X.colwise().minCoeff();
    const double size = (X.colwise().maxCoeff() - low).maxCoeff(), most = (1 << bits) - 1;
    std::vector<std::uint64_t> codes(X.rows(), 0);
    for (Eigen::Index i = 0; i < X.rows(); ++i)
        for (int axis = 0; axis < 3; ++axis) {
            const double place = size > 0 ? (X(i, axis) - low[axis]) / size : 0;
            codes[i] |= spread(static_cast<std::uint64_t>(place * most)) << axis;
        }
    return codes;
}

/// 0, 1, ... in the order of key(i).
template <class Key>
std::vector<int> sorted_by(Eigen::Index count, const Key& key) {
    std::vector<int> order(count);
    std::iota(order.begin(), order.end(), 0);
    std::ranges::stable_sort(order, {}, key);
    return order;
}

}  // namespace

void order_by_place(TetMesh& tets) {
    const std::vector<std::uint64_t> codes = morton_codes(tets.X);
    const std::vector<int> nodes = sorted_by(tets.X.rows(), [&](int i) { return codes[i]; });
    std::vector<int> place(nodes.size());
    for (std::size_t k = 0; k < nodes.size(); ++k) place[nodes[k]] = k;
    tets.X = Nodes(tets.X(nodes, Eigen::all));
    for (int& node : tets.T.reshaped()) node = place[node];
    for (int& node : tets.E.reshaped()) node = place[node];
    const std::vector<int> order = sorted_by(tets.T.rows(), [&](int t) { return tets.T.row(t).minCoeff(); });
    tets.T = Tets(tets.T(order, Eigen::all));
    if (tets.is_quadratic()) tets.E = TetEdges(tets.E(order, Eigen::all));
    if (tets.fill.rows() > 0) tets.fill = TetFill(tets.fill(order, Eigen::all));
}

}  // namespace nbd
