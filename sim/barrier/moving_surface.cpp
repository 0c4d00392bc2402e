#include "sim/barrier/moving_surface.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "collision/query/pair_query.hpp"
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

std::shared_ptr<const CollisionTree> tree_of(const ContactShape& shape, NodesRef X, const Nodes& rest,
                                             bool hangs_on_nodes) {
    CollisionTree tree = make_exact_tree(rest.cast<float>(), shape.F);
    if (hangs_on_nodes) hang_on_nodes(tree, shape.W.cast<float>(), X.cast<float>());
    return std::make_shared<const CollisionTree>(std::move(tree));
}

BoundKind bounds_of(bool hangs_on_nodes) { return hangs_on_nodes ? BoundKind::affine : BoundKind::boxes; }

}  // namespace

MovingSurface::MovingSurface(std::shared_ptr<const ContactShape> shape, const TetMesh& tets, int body)
    : shape_(std::move(shape)),
      body_(body),
      hangs_on_nodes_(shape_->is_much_finer && shape_->overhang <= -AffineModel::least_weight),
      rest_nodes_(tets.X),
      rest_(placed(shape_->W, tets.X)),
      shared_tree_(tree_of(*shape_, tets.X, rest_, hangs_on_nodes_)),
      tree_(shared_tree_, bounds_of(hangs_on_nodes_)),
      own_tree_(shared_tree_, bounds_of(hangs_on_nodes_)) {
    for (int v = 0; v < shape_->vertex_count(); ++v)
        most_carriers_ =
            std::max(most_carriers_, shape_->W.outerIndexPtr()[v + 1] - shape_->W.outerIndexPtr()[v]);
    move(tets.X, tets.X);
    if (shape_->is_much_finer) find_hosts(tets);
}

MovingSurface::MovingSurface(const MovingSurface& twin, int body)
    : shape_(twin.shape_),
      body_(body),
      hangs_on_nodes_(twin.hangs_on_nodes_),
      most_carriers_(twin.most_carriers_),
      rest_nodes_(twin.rest_nodes_),
      rest_(twin.rest_),
      shared_tree_(twin.shared_tree_),
      tree_(shared_tree_, bounds_of(hangs_on_nodes_)),
      own_tree_(shared_tree_, bounds_of(hangs_on_nodes_)),
      hosts_(twin.hosts_) {
    if (hosts_) proof_.emplace(hosts_);
    move(rest_nodes_, rest_nodes_);
}

/// In the rest pose.
void MovingSurface::find_hosts(const TetMesh& tets) {
    constexpr double share = 0.5;  // of the size of a leaf, that others near it may be apart
    const WideTree& tree = *tree_.box_tree();
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
    const auto near = query.box_leaves_within(tree_, own_tree_, distance, [&](int, int) { return distance; });
    hosts_ = std::make_shared<const HostNeighbours>(shape_, tets, rest_, tree, near);
    proof_.emplace(hosts_);
    proof_->prove(rest_nodes_, rest_nodes_);
}

MovingSurface::MovingSurface(const Faces& F, const Nodes& rest, int body)
    : MovingSurface(shape_of_vertices(F, rest), TetMesh{rest, {}}, body) {}

Eigen::RowVector3d MovingSurface::position(int vertex, const Nodes& points) const noexcept {
    if (!hangs_on_nodes_) return points.row(vertex);
    const Embedding& W = shape_->W;
    const int begin = W.outerIndexPtr()[vertex], end = W.outerIndexPtr()[vertex + 1];
    return embedded_position(end - begin, W.innerIndexPtr() + begin, W.valuePtr() + begin, points.data(),
                             points.outerStride());
}

void MovingSurface::begin_step(PosedTree& tree, const Vertices& begin, const Vertices& end) const {
    if (hangs_on_nodes_)
        tree.begin_step_of_nodes(begin, end);
    else
        tree.begin_step(begin, end);
}

void MovingSurface::move(Nodes begin, Nodes end) {
    if (proof_) proof_->prove(begin, end);
    begin_ = hangs_on_nodes_ ? std::move(begin) : placed(shape_->W, begin);
    end_ = hangs_on_nodes_ ? std::move(end) : placed(shape_->W, end);
    begin_float_ = begin_.cast<float>();
    end_float_ = end_.cast<float>();
    begin_step(tree_, begin_float_, end_float_);
    if (is_obstacle()) return;
    mean_motion_ = (end_ - begin_).colwise().mean().transpose();
    own_end_float_ = (end_.rowwise() - mean_motion_.transpose()).cast<float>();
    begin_step(own_tree_, begin_float_, own_end_float_);
}

double MovingSurface::rounding() const noexcept {
    // Of a vertex, or of the weights and sum of its nodes.
    const double steps = hangs_on_nodes_ ? 2 * most_carriers_ : 1;
    return steps * 0x1p-24 * std::sqrt(3.0) *
           std::max(begin_.cwiseAbs().maxCoeff(), end_.cwiseAbs().maxCoeff());
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
