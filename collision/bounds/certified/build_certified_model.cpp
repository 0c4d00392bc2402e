#include "collision/bounds/certified/build_certified_model.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <stdexcept>
#include <utility>

#include "collision/base/message.hpp"
#include "collision/base/stop.hpp"
#include "collision/bounds/certified/enclosing_ellipsoid.hpp"
#include "collision/bounds/certified/path_forest.hpp"
#include "collision/bounds/certified/segment_walk.hpp"
#include "collision/bounds/certified/solid_meter.hpp"

namespace nbd {
namespace {

void check_input(const SphereTree& tree, const TetMesh& solid, const SurfaceWeights& W,
                 const CertifiedConfig& config) {
    if (config.anchors < 1 || config.anchors > 4096 || !(config.spread >= 0 && std::isfinite(config.spread)))
        throw std::invalid_argument(message("certified bounds: ", config.anchors, " anchors and a spread of ",
                                            config.spread,
                                            ", allowed: 1 to 4096 anchors and a spread of 0 or more"));
    check_solid(solid);
    if (W.cols() != solid.X.rows())
        throw std::invalid_argument(message("certified bounds: weights for ", W.cols(),
                                            " nodes, but the solid has ", solid.X.rows()));
    for (const int v : tree.vertices)
        if (v >= W.rows())
            throw std::invalid_argument(message("certified bounds: weights for ", W.rows(),
                                                " vertices, but the tree lists vertex ", v));
}

/// Bound on the position errors of a vertex and an anchor together, relative to coordinate size: k weights
/// rounded to float32, k products and sums, and weights whose sum is not exactly 1.
float position_rounding(const SurfaceWeights& W) {
    constexpr double u = std::numeric_limits<float>::epsilon() / 2;
    double most = 0;
    for (int v = 0; v < W.rows(); ++v) {
        double size = 0, sum = 0;
        int count = 0;
        for (SurfaceWeights::InnerIterator w(W, v); w; ++w, ++count) {
            size += std::abs(static_cast<double>(w.value()));
            sum += static_cast<double>(w.value());
        }
        most = std::max(most, (2 * count + 4) * u * size + std::abs(sum - 1));
    }
    return static_cast<float>(2 * std::sqrt(3.0) * most);
}

/// Rounds a length up by more than all gaps and rounding errors of a path.
float rounded_up(double length) { return static_cast<float>(length * (1 + 1e-6)); }

/// Builds the cells of one tree node after another.
class CellBuilder {
 public:
    CellBuilder(const SphereTree& tree, const SolidGraph& graph, const TetMesh& solid,
                const CertifiedConfig& config, CertifiedModel& model)
        : tree_(tree),
          graph_(graph),
          walk_(solid),
          config_(config),
          model_(model),
          forest_(graph),
          wanted_(static_cast<std::size_t>(graph.point_count()), 0) {}

    void add_node(int node) {
        const std::span<const int> listed = tree_.node_vertices(node);
        vertices_.assign(listed.begin(), listed.end());
        std::ranges::sort(vertices_);
        const auto [first, last] = std::ranges::unique(vertices_);
        vertices_.erase(first, last);
        choose_anchors();
        // Points that several vertices share, or paths of equal length, may leave an anchor without vertices,
        // so the walk to the root decides.
        std::map<int, std::vector<int>> cells;
        for (const int v : vertices_) cells[forest_.walk(point(v), [](const auto&) {})].push_back(v);
        for (const auto& [root, vertices] : cells) add_cell(anchor_at_.at(root), vertices);
    }

 private:
    int point(int v) const { return graph_.place(v).point; }

    void choose_anchors() {
        Eigen::RowVector3d centre = Eigen::RowVector3d::Zero();
        for (const int v : vertices_) centre += graph_.X().row(v);
        centre /= static_cast<double>(vertices_.size());
        std::set<int> points;
        for (const int v : vertices_) points.insert(point(v));
        for (const int p : points) wanted_[static_cast<std::size_t>(p)] = 1;
        forest_.clear();
        anchor_at_.clear();
        double limit = PathForest::unreached;
        // At least one anchor in every connected part.
        for (int k = 0; k < config_.anchors || limit == PathForest::unreached; ++k) {
            stop_if_asked();
            int next = -1;
            double farthest = -1;
            for (const int v : vertices_) {
                if (anchor_at_.contains(point(v))) continue;
                const double path = k == 0 ? 0 : forest_.distance(point(v));
                const double out = path == PathForest::unreached
                                       ? path
                                       : (graph_.X().row(v) - centre).norm() + config_.spread * path;
                if (out > std::exchange(farthest, std::max(farthest, out))) next = v;
            }
            if (next < 0) break;
            anchor_at_[point(next)] = next;
            forest_.grow(point(next), limit, wanted_, k == 0 ? static_cast<int>(points.size()) : 0);
            limit = 0;
            for (const int p : points) limit = std::max(limit, forest_.distance(p));
        }
        for (const int p : points) wanted_[static_cast<std::size_t>(p)] = 0;
    }

    /// Adds a path from the anchor to a vertex: straight if that stays inside the solid, else along the
    /// links. Returns its length and adds its lengths in each region to `by_region`.
    double add_path(int anchor, int vertex, std::map<int, double>& by_region) {
        const SolidGraph::Place &from = graph_.place(anchor), &to = graph_.place(vertex);
        const Eigen::Vector3d p = graph_.X().row(anchor), q = graph_.X().row(vertex);
        if (!to.homes.empty() && walk_.inside(p, q, from.homes, pieces_)) {
            const double length = (q - p).norm();
            for (const SegmentWalk::Piece& piece : pieces_)
                by_region[model_.regions.of_tet[static_cast<std::size_t>(piece.tet)]] += piece.share * length;
            return length;
        }
        double length = from.tail + to.tail;
        for (const SolidGraph::Place* place : {&from, &to})
            for (const int region : place->regions) by_region[region] += place->tail;
        forest_.walk(point(vertex), [&](const SolidGraph::Link& link) {
            length += link.length;
            by_region[link.region] += link.length;
        });
        return length;
    }

    void add_cell(int anchor, const std::vector<int>& vertices) {
        CertifiedModel::Cell cell{.anchor = anchor, .weight = static_cast<float>(vertices.size())};
        std::map<int, double> sums, longest_in;
        std::vector<Eigen::Vector3d> offsets;
        double longest = 0;
        for (const int v : vertices) {
            stop_if_asked();
            offsets.emplace_back(graph_.X().row(v) - graph_.X().row(anchor));
            if (v == anchor) continue;
            std::map<int, double> by_region;
            longest = std::max(longest, add_path(anchor, v, by_region));
            for (const auto& [region, length] : by_region) {
                sums[region] += length;
                double& most = longest_in[region];
                most = std::max(most, length);
            }
        }
        cell.path = rounded_up(longest);
        const Ellipsoid around = enclosing_ellipsoid(offsets);
        cell.m = around.m;
        cell.B = around.B;
        if (!sums.empty())
            cell.carrier = std::ranges::max_element(sums, {}, [](const auto& r) { return r.second; })->first;
        cell.leg_begin = static_cast<int>(model_.legs.size());
        for (const auto& [region, length] : longest_in)
            if (longest > 0) model_.legs.push_back({pair(cell.carrier, region), rounded_up(length)});
        cell.leg_end = static_cast<int>(model_.legs.size());
        model_.cells.push_back(cell);
    }

    int pair(int carrier, int other) {
        const auto [known, is_new] =
            pair_numbers_.try_emplace({carrier, other}, static_cast<int>(model_.pairs.size()));
        if (is_new) model_.pairs.push_back({carrier, other});
        return known->second;
    }

    const SphereTree& tree_;
    const SolidGraph& graph_;
    SegmentWalk walk_;
    const CertifiedConfig& config_;
    CertifiedModel& model_;
    PathForest forest_;
    std::vector<char> wanted_;      // [points] 1 for the points of the node's vertices
    std::vector<int> vertices_;     // vertices of the node
    std::map<int, int> anchor_at_;  // anchor vertex by point
    std::vector<SegmentWalk::Piece> pieces_;
    std::map<std::pair<int, int>, int> pair_numbers_;
};

}  // namespace

CertifiedModel build_certified_model(const SphereTree& tree, FacesRef F, const TetMesh& solid,
                                     const SurfaceWeights& W, const CertifiedConfig& config) {
    check_input(tree, solid, W, config);
    CertifiedModel model;
    model.regions = tet_regions(tree, solid, W, config.regions);
    const SolidGraph graph(solid, W, F, model.regions.of_tet);
    model.rounding = position_rounding(W);
    model.reach = rounded_up(graph.reach());
    CellBuilder cells(tree, graph, solid, config, model);
    model.cell_begin = {0};
    for (int node = 0; std::cmp_less(node, tree.nodes.size()); ++node) {
        cells.add_node(node);
        model.cell_begin.push_back(static_cast<int>(model.cells.size()));
    }
    return model;
}

}  // namespace nbd
