#include "collision/bounds/certified/tet_regions.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>
#include <utility>

#include "collision/base/message.hpp"

namespace nbd {
namespace {

/// Leaf of each node: the leaf of a surface vertex that depends on this node most, else the leaf of the
/// nearest node with such a vertex, counted in edges.
std::vector<int> leaf_of_nodes(const SphereTree& tree, const TetMesh& solid, const SurfaceWeights& W) {
    std::vector<int> leaf(static_cast<std::size_t>(solid.X.rows()), -1), front;
    for (int i = 0; std::cmp_less(i, tree.nodes.size()); ++i) {
        if (!tree.nodes[static_cast<std::size_t>(i)].is_leaf()) continue;
        for (const int v : tree.node_vertices(i)) {
            int heaviest = -1;
            float most = 0;
            for (SurfaceWeights::InnerIterator w(W, v); w; ++w)
                if (std::abs(w.value()) > std::exchange(most, std::max(most, std::abs(w.value()))))
                    heaviest = static_cast<int>(w.col());
            if (heaviest < 0 || leaf[static_cast<std::size_t>(heaviest)] >= 0) continue;
            leaf[static_cast<std::size_t>(heaviest)] = i;
            front.push_back(heaviest);
        }
    }
    std::vector<std::vector<int>> tets_of(leaf.size());
    for (int t = 0; t < solid.T.rows(); ++t)
        for (const int node : solid.T.row(t)) tets_of[static_cast<std::size_t>(node)].push_back(t);
    for (std::size_t k = 0; k < front.size(); ++k)
        for (const int t : tets_of[static_cast<std::size_t>(front[k])])
            for (const int node : solid.T.row(t))
                if (leaf[static_cast<std::size_t>(node)] < 0) {
                    leaf[static_cast<std::size_t>(node)] = leaf[static_cast<std::size_t>(front[k])];
                    front.push_back(node);
                }
    return leaf;
}

/// The leaf of most corners of a tetrahedron; the first of equally frequent ones.
int common_leaf(const Tets& T, int t, const std::vector<int>& leaf) {
    int best = -1;
    std::ptrdiff_t most = 0;
    for (const int node : T.row(t)) {
        const int own = leaf[static_cast<std::size_t>(node)];
        const auto count = std::ranges::count_if(
            T.row(t), [&](int other) { return leaf[static_cast<std::size_t>(other)] == own; });
        if (count > std::exchange(most, std::max(most, count))) best = own;
    }
    return best;
}

void halve(std::span<int> tets, const TetMesh& solid, int splits, std::vector<std::span<int>>& parts) {
    if (splits == 0 || tets.size() < 2) {
        if (!tets.empty()) parts.push_back(tets);
        return;
    }
    const auto centroid = [&](int t) -> Eigen::RowVector3d {
        Eigen::RowVector3d sum = Eigen::RowVector3d::Zero();
        for (const int node : solid.T.row(t)) sum += solid.X.row(node);
        return sum / 4;
    };
    Eigen::RowVector3d lo = centroid(tets[0]), hi = lo;
    for (const int t : tets) {
        lo = lo.cwiseMin(centroid(t));
        hi = hi.cwiseMax(centroid(t));
    }
    Eigen::Index axis = 0;
    (hi - lo).maxCoeff(&axis);
    std::ranges::sort(tets, {}, [&](int t) { return std::pair(centroid(t)[axis], t); });
    halve(tets.first(tets.size() / 2), solid, splits - 1, parts);
    halve(tets.subspan(tets.size() / 2), solid, splits - 1, parts);
}

}  // namespace

TetRegions tet_regions(const SphereTree& tree, const TetMesh& solid, const SurfaceWeights& W,
                       const TetRegionConfig& config) {
    if (config.splits < 0 || config.splits > 8 || config.samples < 1)
        throw std::invalid_argument(message("regions of tetrahedra: ", config.splits, " splits and ",
                                            config.samples,
                                            " samples, allowed: 0 to 8 splits and 1 or more samples"));
    const std::vector<int> leaf = leaf_of_nodes(tree, solid, W);
    // The last entry takes tetrahedra that are connected with no vertex.
    std::vector<std::vector<int>> of_leaf(tree.nodes.size() + 1);
    for (int t = 0; t < solid.T.rows(); ++t) {
        const int own = common_leaf(solid.T, t, leaf);
        of_leaf[own < 0 ? tree.nodes.size() : static_cast<std::size_t>(own)].push_back(t);
    }
    TetRegions regions;
    regions.of_tet.resize(static_cast<std::size_t>(solid.T.rows()));
    regions.sample_begin = {0};
    for (std::vector<int>& tets : of_leaf) {
        std::vector<std::span<int>> parts;
        halve(tets, solid, config.splits, parts);
        for (const std::span<int> part : parts) {
            for (const int t : part) regions.of_tet[static_cast<std::size_t>(t)] = regions.count();
            const std::size_t samples = std::min(part.size(), static_cast<std::size_t>(config.samples));
            for (std::size_t k = 0; k < samples; ++k)
                regions.samples.push_back(part[(2 * k + 1) * part.size() / (2 * samples)]);
            regions.sample_begin.push_back(static_cast<int>(regions.samples.size()));
        }
    }
    return regions;
}

}  // namespace nbd
