#include "collision/wide_tree/posed_wide_tree.hpp"

#include <cassert>
#include <cstring>
#include <utility>

namespace nbd {
namespace {

/// One register: a vector of the compiler.
using Four = float __attribute__((vector_size(16)));

Four four_floats(const float* p) noexcept {
    Four result;
    std::memcpy(&result, p, sizeof result);
    return result;
}
Four three_floats(const float* p) noexcept { return Four{p[0], p[1], p[2], 0}; }

/// count: 0 if it is not known at compile time.
template <int fixed_count, class Load>
void sums(const float* points, const int* places, const float* weights, const std::uint16_t* nodes,
          int counted, int vertices, float* x, const Load& load) noexcept {
    const int count = fixed_count == 0 ? counted : fixed_count;
    for (int v = 0; v < vertices; ++v) {
        Four sum{};
        for (int k = 0; k < count; ++k)
            sum += weights[v * count + k] * load(points + places[nodes[v * count + k]]);
        std::memcpy(x + 4 * v, &sum, sizeof sum);
    }
}

/// Positions of a leaf's vertices: the sum over k of weights[v * count + k] times the node at points +
/// places[nodes[v * count + k]], in this order and without fused products, like embedded_position(). at_end:
/// whether the array of points may end after one of these nodes. x: [vertices, 4], the fourth number is
/// unspecified.
void leaf_positions(const float* points, const int* places, const float* weights, const std::uint16_t* nodes,
                    int count, int vertices, bool at_end, float* x) noexcept {
    if (at_end) return sums<0>(points, places, weights, nodes, count, vertices, x, three_floats);
    if (count == 1) return sums<1>(points, places, weights, nodes, count, vertices, x, four_floats);
    if (count == 3) return sums<3>(points, places, weights, nodes, count, vertices, x, four_floats);
    if (count == 4) return sums<4>(points, places, weights, nodes, count, vertices, x, four_floats);
    sums<0>(points, places, weights, nodes, count, vertices, x, four_floats);
}

/// The numbers of some nodes, three each; copied to `own` if there is room between their rows.
const float* contiguous(const VertexView& nodes, Vertices& own) {
    if (nodes.stride() == 3) return nodes.data();
    own = nodes.rows();
    return own.data();
}

}  // namespace

PosedWideTree::PosedWideTree(std::shared_ptr<const AffineModel> model,
                             std::optional<LearnedAffineBoxes> learned)
    : model_(std::move(model)),
      learned_(std::move(learned)),
      tree_(&model_->tree()),
      boxes_(tree_->clusters()),
      boxes_at_start_(boxes_.size()),
      cluster_boxes_(static_cast<std::size_t>((tree_->clusters() + tree_width - 1) / tree_width)),
      clusters_(tree_->clusters()),
      blocks_(tree_->blocks()),
      leaves_(tree_width * tree_->blocks()),
      scratch_(model_->scratch()) {}

void PosedWideTree::begin_pose(VertexView nodes) {
    assert(nodes.count() == model_->node_count());
    given_ = nodes;
    given_start_ = {};
    nodes_ = contiguous(nodes, own_);
    start_ = nullptr;
    begin();
}

void PosedWideTree::begin_step(VertexView start, VertexView end) {
    assert(start.count() == model_->node_count() && end.count() == model_->node_count());
    given_ = end;
    given_start_ = start;
    // Without memory for either array there is no step.
    const float* at_start = contiguous(start, own_start_);
    nodes_ = contiguous(end, own_);
    start_ = at_start;
    begin();
}

void PosedWideTree::forget_pose() noexcept {
    given_ = given_start_ = {};
    nodes_ = start_ = nullptr;
    whole_ = empty_box();
    bounded_ = 0;
    met_non_finite_ = false;
    if (learned_) learned_->begin_pose(nullptr);
}

void PosedWideTree::require_finite() const {
    if (!met_non_finite()) return;
    const char* what = model_->rest().rows() > 0 ? "node" : "vertex";
    require_finite_rows(what, given_start_);
    require_finite_rows(what, given_);
}

void PosedWideTree::begin() noexcept {
    clusters_.begin_pose();
    blocks_.begin_pose();
    leaves_.begin_pose();
    bounded_ = 0;
    met_non_finite_ = false;
    whole_ = empty_box();
    if (learned_) learned_->begin_pose(nodes_);
    if (is_learned())
        learned_cluster_boxes();
    else
        exact_cluster_boxes();
    // All nodes that carry vertices were read here. Positions are sums of them, finite unless the sums
    // overflow.
    constexpr float large = 1e37f;
    reads_unchecked_ = is_learned() || !(whole_.lo > -large && whole_.hi < large).all();
}

void PosedWideTree::set_cluster_box(int cluster, const Box& box) noexcept {
    cluster_boxes_[cluster / tree_width].set(cluster % tree_width, box);
    whole_ = joined(whole_, box);
}

void PosedWideTree::exact_cluster_boxes() noexcept {
    met_non_finite_ |= !model_->cluster_nodes().boxes(nodes_, boxes_);
    if (start_) met_non_finite_ |= !model_->cluster_nodes().boxes(start_, boxes_at_start_);
    for (int cluster = 0; cluster < tree_->clusters(); ++cluster) {
        const std::size_t c = cluster;
        set_cluster_box(cluster, widened(start_ ? joined(boxes_[c], boxes_at_start_[c]) : boxes_[c]));
    }
}

void PosedWideTree::learned_cluster_boxes() noexcept {
    constexpr int ahead = 2;
    for (int cluster = 0; cluster < tree_->clusters(); ++cluster) {
        if (cluster + ahead < tree_->clusters()) learned_->prefetch_box(cluster + ahead);
        Box box;
        if (!learned_->box(cluster, box)) box = box_of_nodes(model_->clusters().nodes(cluster));
        set_cluster_box(cluster, box);
    }
}

void PosedWideTree::map_children(const AffineParts& parts, int i, Children& children) noexcept {
    const AffinePart part = parts.part(i);
    const auto map_from = [&](const float* nodes, BoxPack& boxes, OrientedBoxes* oriented) {
        kernels().affine_map(part, parts.rest_boxes(i), nodes, model_->rounding(), scratch_.data(), boxes,
                             oriented);
    };
    children.are_oriented = !start_;
    map_from(nodes_, children.boxes, children.are_oriented ? &children.oriented : nullptr);
    if (!start_) return;
    BoxPack at_start;
    map_from(start_, at_start, nullptr);
    children.boxes.join(at_start);
}

void PosedWideTree::fit_children(const AffineParts& parts, int part, int count, bool learned,
                                 Children& children) noexcept {
    using enum AffineParts::ChildBounds;
    ++bounded_;
    children.are_oriented = false;
    const AffineParts::ChildBounds bounds = parts.child_bounds(part);
    if (!learned && bounds == map)
        map_children(parts, part, children);
    else if (!learned && bounds == nodes)
        boxes_of_child_nodes(parts, part, count, children.boxes);
    else if (!learned)
        boxes_of_blocks(part, count, children.boxes);
    children.whole = hull(children.boxes, count);
}

void PosedWideTree::fit_cluster(int cluster) {
    Children& children = clusters_.add(cluster);
    const bool learned = is_learned() && learned_->blocks(cluster, children.boxes);
    fit_children(model_->clusters(), cluster, tree_->blocks_in(cluster), learned, children);
}

void PosedWideTree::fit_block(int block) {
    Children& children = blocks_.add(block);
    const bool learned = is_learned() && learned_->leaves(block, children.boxes);
    fit_children(model_->blocks(), block, tree_->leaves_in[block], learned, children);
}

void PosedWideTree::leaf_vertices(int i, const float* nodes, Eigen::Array4f* x) const noexcept {
    const AffineModel::LeafWeights weights = model_->leaf_weights(i);
    const std::span<const int> places = model_->blocks().nodes(i / tree_width);
    leaf_positions(nodes, places.data(), weights.weights, weights.nodes, weights.count,
                   tree_->leaf_vertices(i).size(), has_last_node(places), x[0].data());
}

void PosedWideTree::leaf_boxes(int i, const Eigen::Array4f* x, BoxPack& boxes, Box& whole) noexcept {
    kernels().triangle_boxes(x[0].data(), tree_->corners[i].data(), boxes);
    whole = hull(boxes);
    for (std::size_t v = 0; reads_unchecked_ && v < tree_->leaf_vertices(i).size(); ++v)
        met_non_finite_ |= !(0 * x[v].head<3>() == 0).all();
}

void PosedWideTree::fit_leaf(int i) {
    Leaf& leaf = leaves_.add(i);
    ++bounded_;
    leaf_vertices(i, nodes_, leaf.x);
    leaf_boxes(i, leaf.x, leaf.boxes, leaf.whole);
    if (!start_) return;
    Eigen::Array4f x[WideTree::max_leaf_vertices];
    BoxPack boxes;
    Box whole;
    leaf_vertices(i, start_, x);
    leaf_boxes(i, x, boxes, whole);
    leaf.boxes.join(boxes);
    leaf.whole = joined(leaf.whole, whole);
}

bool PosedWideTree::has_last_node(std::span<const int> nodes) const noexcept {
    return !nodes.empty() && nodes.back() == 3 * (model_->node_count() - 1);
}

float PosedWideTree::slack(const Box& box) const noexcept {
    if (model_->rounding() == 0) return 0;
    return model_->rounding() * std::max(box.lo.abs().maxCoeff(), box.hi.abs().maxCoeff()) + 0x1p-100f;
}

Box PosedWideTree::widened(const Box& box) const noexcept {
    const float by = slack(box);
    return {box.lo - Eigen::Array4f(by, by, by, 0), box.hi + Eigen::Array4f(by, by, by, 0)};
}

template <class BoxAt>
Box PosedWideTree::over_step(const BoxAt& box_at) const noexcept {
    return start_ ? joined(box_at(start_), box_at(nodes_)) : box_at(nodes_);
}

Box PosedWideTree::box_of_nodes(std::span<const int> nodes) noexcept {
    // The kernel reads a fourth number of each node, and none may follow the last one in memory.
    const bool at_end = has_last_node(nodes);
    const int count = std::ssize(nodes) - at_end;
    return widened(over_step([&](const float* x) {
        Box box;
        met_non_finite_ |= !kernels().box_of_points(x, nodes.data(), count, numbers(box));
        return at_end ? joined(box, box_of_node(x + nodes.back())) : box;
    }));
}

void PosedWideTree::boxes_of_blocks(int cluster, int count, BoxPack& boxes) noexcept {
    for (int k = 0; k < count; ++k)
        boxes.set(k, box_of_nodes(model_->blocks().nodes(first_block(cluster) + k)));
}

void PosedWideTree::boxes_of_child_nodes(const AffineParts& parts, int part, int count,
                                         BoxPack& boxes) noexcept {
    const std::span<const std::int32_t> places = parts.child_nodes(part);
    const bool at_end = has_last_node(parts.nodes(part));
    const auto make = [&](const float* x, BoxPack& made) {
        met_non_finite_ |= !kernels().boxes_of_points(
            x, places.data(), static_cast<int>(places.size()) / tree_width, at_end, made);
    };
    make(nodes_, boxes);
    if (start_) {
        BoxPack before;
        make(start_, before);
        boxes.join(before);
    }
    if (model_->rounding() != 0) boxes.grow(slack(hull(boxes, count)));
}

Box PosedWideTree::box_of_node(const float* p) noexcept {
    const Eigen::Array4f point(p[0], p[1], p[2], 0);
    met_non_finite_ |= !(0 * point == 0).all();
    return {point, point};
}

void PosedWideTree::prefetch_cluster(int cluster) const noexcept {
    if (clusters_.has(cluster)) return;
    if (is_learned()) return learned_->prefetch_blocks(cluster);
    using enum AffineParts::ChildBounds;
    const AffineParts &clusters = model_->clusters(), &blocks = model_->blocks();
    if (clusters.child_bounds(cluster) == nodes) {
        prefetch_lines(clusters.child_nodes(cluster));
    } else if (clusters.child_bounds(cluster) == own_parts) {
        const std::span<const int> begin = blocks.nodes(first_block(cluster)),
                                   end = blocks.nodes(first_block(cluster + 1) - 1);
        prefetch_lines(std::span(begin.data(), end.data() + end.size()));
    }
}

void PosedWideTree::prefetch_block(int block) const noexcept {
    if (blocks_.has(block)) return;
    if (is_learned()) return learned_->prefetch_leaves(block);
    model_->blocks().prefetch(block);
}

void PosedWideTree::prefetch_leaf(int leaf) const noexcept {
    if (leaves_.has(leaf)) return;
    prefetch_line(tree_->corners[leaf].data());
    const AffineModel::LeafWeights weights = model_->leaf_weights(leaf);
    const auto entries = tree_->leaf_vertices(leaf).size() * static_cast<std::size_t>(weights.count);
    prefetch_lines(std::span(weights.weights, entries));
    prefetch_lines(std::span(weights.nodes, entries));
}

}  // namespace nbd
