#include "sim/barrier/moving_surface.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "collision/query/pair_query.hpp"
#include "collision/tree/auto_bounds.hpp"
#include "meshing/parallel/parallel_for.hpp"

namespace nbd {
namespace {

std::shared_ptr<const ContactShape> shape_of_vertices(const Faces& F, const Nodes& rest) {
    Embedding W(rest.rows(), rest.rows());
    W.setIdentity();
    return std::make_shared<const ContactShape>(std::move(W), F, rest);
}

/// Where the vertices stand, row by row. nodes: [N, 3].
Nodes placed(const Embedding& W, const Nodes& nodes) {
    Nodes x(W.rows(), 3);
    parallel_for(W.rows(), [&](int v) {
        const int begin = W.outerIndexPtr()[v], end = W.outerIndexPtr()[v + 1];
        x.row(v) = embedded_position(end - begin, W.innerIndexPtr() + begin, W.valuePtr() + begin,
                                     nodes.data(), nodes.outerStride());
    });
    return x;
}

bool hangs(const CollisionTree& tree, const Embedding& W) {
    return tree.affine && tree.affine->hangs_by(W.cast<float>());
}

/// The tree that is given, if it serves, or a new one.
std::shared_ptr<const CollisionTree> exact_tree(const PairBounds& bounds, const ContactShape& shape,
                                                NodesRef X, const Nodes& rest, bool hangs_on_nodes) {
    if (bounds.tree && (!hangs_on_nodes || hangs(*bounds.tree, shape.W))) return bounds.tree;
    CollisionTree tree = make_exact_tree(rest.cast<float>(), shape.F);
    if (hangs_on_nodes) hang_on_nodes(tree, shape.W.cast<float>(), X.cast<float>());
    return std::make_shared<const CollisionTree>(std::move(tree));
}

PosedTree exact(const std::shared_ptr<const CollisionTree>& tree, bool hangs_on_nodes) {
    return {tree, hangs_on_nodes ? BoundKind::affine : BoundKind::boxes};
}

PosedTree bounded(const PairBounds& bounds, const std::shared_ptr<const CollisionTree>& own,
                  bool hangs_on_nodes) {
    if (!bounds.tree) return exact(own, hangs_on_nodes);
    return {bounds.tree, exact_for_auto(*bounds.tree, bounds.kind), bounds.margin};
}

int most_carriers(const Embedding& W) {
    int most = 0;
    for (Eigen::Index v = 0; v < W.rows(); ++v)
        most = std::max(most, W.outerIndexPtr()[v + 1] - W.outerIndexPtr()[v]);
    return most;
}

}  // namespace

MovingSurface::MovingSurface(std::shared_ptr<const ContactShape> shape, const TetMesh& tets, int body,
                             const PairBounds& bounds)
    : shape_(std::move(shape)),
      body_(body),
      hangs_on_nodes_(shape_->is_much_finer && shape_->overhang <= -AffineModel::least_weight),
      most_carriers_(most_carriers(shape_->W)),
      rest_nodes_(tets.X),
      rest_(placed(shape_->W, tets.X)),
      shared_tree_(exact_tree(bounds, *shape_, tets.X, rest_, hangs_on_nodes_)),
      tree_(bounded(bounds, shared_tree_, hangs_on_nodes_)),
      own_tree_(exact(shared_tree_, hangs_on_nodes_)) {
    move(tets.X, tets.X);
    if (tets.T.rows() > 0) find_hosts(tets);
}

MovingSurface::MovingSurface(const MovingSurface& twin, int body, const PairBounds& bounds)
    : shape_(twin.shape_),
      body_(body),
      hangs_on_nodes_(twin.hangs_on_nodes_),
      most_carriers_(twin.most_carriers_),
      rest_nodes_(twin.rest_nodes_),
      rest_(twin.rest_),
      shared_tree_(twin.shared_tree_),
      tree_(bounded(bounds, shared_tree_, hangs_on_nodes_)),
      own_tree_(exact(shared_tree_, hangs_on_nodes_)),
      hosts_(twin.hosts_) {
    if (hosts_) proof_.emplace(hosts_);
    move(rest_nodes_, rest_nodes_);
}

/// In the rest pose.
void MovingSurface::find_hosts(const TetMesh& tets) {
    constexpr double share = 0.5;  // of the size of a leaf, that others near it may be apart
    const WideTree& tree = *own_tree_.box_tree();
    WideBoxes boxes;
    fit_wide_boxes(tree, rest_.cast<float>(), boxes);
    double size = 0;
    int count = 0;
    for (int leaf = 0; leaf < tree.leaves(); ++leaf)
        if (tree.faces_in[leaf] > 0) {
            size += (boxes.leaves[leaf].hi - boxes.leaves[leaf].lo).head<3>().matrix().norm();
            ++count;
        }
    const auto distance = static_cast<float>(share * size / count);
    PairQuery query;
    PosedTree twin = exact(shared_tree_, hangs_on_nodes_);
    begin_step(twin);
    const auto near = query.box_leaves_within(own_tree_, twin, distance, [&](int, int) { return distance; });
    hosts_ = std::make_shared<const HostNeighbours>(shape_, tets, rest_, tree, near);
    proof_.emplace(hosts_);
    proof_->prove(rest_nodes_, rest_nodes_);
}

MovingSurface::MovingSurface(const Faces& F, const Nodes& rest, int body)
    : MovingSurface(shape_of_vertices(F, rest), TetMesh{rest, {}}, body) {}

Eigen::RowVector3d MovingSurface::hanging_position(int vertex, const Nodes& points) const noexcept {
    const Embedding& W = shape_->W;
    const int begin = W.outerIndexPtr()[vertex], end = W.outerIndexPtr()[vertex + 1];
    return embedded_position(end - begin, W.innerIndexPtr() + begin, W.valuePtr() + begin, points.data(),
                             points.outerStride());
}

void MovingSurface::place_corners(std::span<const FacePair> pairs, int FacePair::*face) {
    if (!hangs_on_nodes_) return;
    const std::size_t known = placed_vertices_.size();
    int last = -1;
    for (const FacePair& pair : pairs) {
        if (pair.*face == last) continue;
        last = pair.*face;
        for (const int v : F().row(last))
            if (!std::exchange(is_placed_[v], 1)) placed_vertices_.push_back(v);
    }
    parallel_for(placed_vertices_.size() - known, [&](int i) {
        const int v = placed_vertices_[known + i];
        placed_.begin.row(v) = hanging_position(v, begin_);
        placed_.end.row(v) = hanging_position(v, end_);
    });
}

void MovingSurface::begin_step(PosedTree& tree) const {
    if (tree.takes_nodes())
        tree.begin_step_of_nodes(nodes_.begin, nodes_.end);
    else
        tree.begin_step(vertices_.begin, vertices_.end);
}

void MovingSurface::be_exact(bool exact) {
    exact_tree_.reset();
    if (exact && nbd::can_miss(tree_.kind())) exact_tree_.emplace(nbd::exact(shared_tree_, hangs_on_nodes_));
}

void MovingSurface::move(Nodes begin, Nodes end) {
    for (const int v : placed_vertices_) is_placed_[v] = 0;
    placed_vertices_.clear();
    if (hangs_on_nodes_ && is_placed_.empty()) {
        is_placed_.assign(rest_.rows(), 0);
        placed_.begin = placed_.end = Nodes::Zero(rest_.rows(), 3);
    }
    if (proof_) proof_->prove(begin, end);
    const bool tree_takes_nodes = tree().takes_nodes();
    if (hangs_on_nodes_ || tree_takes_nodes) nodes_ = {begin.cast<float>(), end.cast<float>()};
    largest_ = std::max(begin.cwiseAbs().maxCoeff(), end.cwiseAbs().maxCoeff());
    begin_ = std::move(begin);
    end_ = std::move(end);
    if (!hangs_on_nodes_ || !tree_takes_nodes) {
        Nodes from = placed(shape_->W, begin_), to = placed(shape_->W, end_);
        vertices_ = {from.cast<float>(), to.cast<float>()};
        if (!hangs_on_nodes_) {
            begin_ = std::move(from);
            end_ = std::move(to);
        }
    }
    begin_step(tree());
    if (is_obstacle()) return;
    const Eigen::RowVector3d mean_motion = (end_ - begin_).colwise().mean();
    own_end_ = (end_.rowwise() - mean_motion).cast<float>();
    if (hangs_on_nodes_)
        own_tree_.begin_step_of_nodes(nodes_.begin, own_end_);
    else
        own_tree_.begin_step(vertices_.begin, own_end_);
}

double MovingSurface::rounding() const noexcept {
    // Of a vertex, or of the weights and sum of its nodes.
    const double steps = hangs_on_nodes_ || tree_.takes_nodes() ? 2 * most_carriers_ : 1;
    return steps * 0x1p-24 * std::sqrt(3.0) * largest_;
}

std::array<FeatureCorner, 4> corners(const FeaturePair& pair, const std::vector<MovingSurface>& surfaces) {
    const auto numbered = [&](int surface) { return surfaces[surface].numbered(surface); };
    const auto vertices = feature_vertices(pair, numbered(pair.surface_a), numbered(pair.surface_b));
    std::array<FeatureCorner, 4> result;
    for (std::size_t k = 0; k < 4; ++k)
        result[k] = {k < corners_of_a(pair.kind) ? pair.surface_a : pair.surface_b, vertices[k]};
    return result;
}

}  // namespace nbd
