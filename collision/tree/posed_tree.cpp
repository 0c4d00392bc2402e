#include "collision/tree/posed_tree.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

#include "collision/base/message.hpp"
#include "collision/tree/auto_bounds.hpp"

namespace nbd {
namespace {

void check_margin(std::optional<float> margin, BoundKind kind) {
    if (margin && !(*margin >= 0 && std::isfinite(*margin)))
        throw std::invalid_argument(message("margin is ", *margin, ", allowed: finite and 0 or more"));
    if (margin.value_or(0.f) > 0 && (kind == BoundKind::boxes || kind == BoundKind::affine))
        throw std::invalid_argument(message("margin is ", *margin, ", but exact boxes take none"));
}

/// Throws std::invalid_argument, saying what to do, unless the tree has bounds of this kind that are usable:
/// others would miss at no stated rate.
void check_bounds(const CollisionTree& tree, BoundKind kind, std::optional<float> margin) {
    if (is_usable(tree, kind, margin)) return;
    if (has_bounds(tree, kind))
        throw std::invalid_argument(message(
            "the tree's \"", name(kind),
            "\" bounds are not calibrated, so that nodes miss at no stated rate; run `nbdtree calibrate` "
            "on the tree, or give a margin (--margin)"));
    std::string available = "exact";
    for (const BoundKind other : bound_kinds)
        if (other != BoundKind::exact && has_bounds(tree, other)) available.append(", ").append(name(other));
    throw std::invalid_argument(
        message("the collision tree has no model for \"", name(kind), "\" bounds, only for ", available));
}

PosedNbdTree::Bounds make_bounds(const CollisionTree& tree, BoundKind kind) {
    if (kind == BoundKind::bd) return BdBound(tree.spheres, *tree.bd);
    if (kind == BoundKind::nbd) return NbdBound(tree.spheres, *tree.nbd);
    return ExactBound(tree.spheres);
}

}  // namespace

PosedTree::PosedTree(std::shared_ptr<const CollisionTree> tree, BoundKind kind, std::optional<float> margin)
    : tree_(std::move(tree)), kind_(kind), margin_(margin) {
    if (!tree_) throw std::invalid_argument("a posed tree needs a collision tree, got none");
    check_margin(margin, kind);
    check_collision_tree(*tree_);
    check_bounds(*tree_, kind, margin);
    if (!is_box(kind))
        spheres_.emplace(tree_->spheres, tree_->faces, tree_->vertex_count, make_bounds(*tree_, kind),
                         node_margins(*tree_, kind, margin));
    else if (kind != BoundKind::affine)
        surface_boxes();
    if (reads_nodes(kind) && tree_->affine) of_nodes_.emplace(tree_->affine);
}

PosedWideTree& PosedTree::surface_boxes() {
    if (of_surface_) return *of_surface_;
    const BoundKind kind = kind_ == BoundKind::automatic ? bounds_of_auto(*tree_, false, margin_) : kind_;
    std::optional<LearnedAffineBoxes> learned;
    if (kind == BoundKind::learned_affine)
        learned.emplace(tree_->learned_affine, node_margins(*tree_, kind, margin_));
    return of_surface_.emplace(tree_->boxes ? tree_->boxes : make_boxes(*tree_), std::move(learned));
}

template <class Start>
void PosedTree::begin(const Start& start) {
    try {
        start();
        require_finite();
    } catch (...) {
        forget_pose();
        throw;
    }
}

template <class Start>
void PosedTree::begin_positions(const Start& start) {
    if (of_nodes_) of_nodes_->forget_pose();
    if (!spheres_) return start(surface_boxes());
    if (of_surface_) of_surface_->forget_pose();
    start(*spheres_);
}

void PosedTree::begin_pose(VertexView x) {
    begin([&] {
        check_rows("positions", x);
        begin_positions([&](auto& tree) { tree.begin_pose(x); });
    });
}

void PosedTree::begin_pose_of_nodes(VertexView nodes) {
    begin([&] {
        check_nodes("nodes", nodes);
        if (of_surface_) of_surface_->forget_pose();
        of_nodes_->begin_pose(nodes);
    });
}

void PosedTree::begin_step(VertexView start, VertexView end) {
    begin([&] {
        check_rows("start", start);
        check_rows("end", end);
        begin_positions([&](auto& tree) { tree.begin_step(start, end); });
    });
}

void PosedTree::begin_step_of_nodes(VertexView start, VertexView end) {
    begin([&] {
        check_nodes("start", start);
        check_nodes("end", end);
        if (of_surface_) of_surface_->forget_pose();
        of_nodes_->begin_step(start, end);
    });
}

void PosedTree::forget_pose() noexcept {
    if (spheres_) spheres_->forget_pose();
    for (auto* wide : {&of_nodes_, &of_surface_})
        if (*wide) (*wide)->forget_pose();
}

void PosedTree::check_rows(const char* what, const VertexView& x) const {
    if (x.count() != tree_->vertex_count)
        throw std::invalid_argument(
            message(what, ": ", x.count(), " rows, but the surface has ", tree_->vertex_count, " vertices"));
}

void PosedTree::check_nodes(const char* what, const VertexView& x) const {
    if (!takes_nodes())
        throw std::invalid_argument(
            message("poses of nodes need affine or auto bounds and a tree that hangs on nodes; these are ",
                    name(kind_), tree_->affine ? "" : ", of a tree that does not"));
    if (x.count() != tree_->affine->node_count())
        throw std::invalid_argument(message(what, ": ", x.count(), " rows, but the surface hangs on ",
                                            tree_->affine->node_count(), " nodes"));
}

void PosedTree::reserve() {
    if (spheres_) {
        spheres_->reserve();
        surface_boxes();
    }
    for (auto* wide : {&of_nodes_, &of_surface_})
        if (*wide) (*wide)->reserve();
}

bool PosedTree::has_pose() const noexcept {
    return (spheres_ && spheres_->has_pose()) || (of_nodes_ && of_nodes_->has_pose()) ||
           (of_surface_ && of_surface_->has_pose());
}

PosedWideTree& PosedTree::wide_tree() {
    if (spheres_ && !surface_boxes().has_pose() && spheres_->has_pose()) {
        if (spheres_->in_step())
            of_surface_->begin_step(spheres_->start(), spheres_->positions());
        else
            of_surface_->begin_pose(spheres_->positions());
    }
    return is_moved_by_positions() ? *of_surface_ : *of_nodes_;
}

const Sphere& PosedTree::sphere(int node) {
    if (!spheres_)
        throw std::invalid_argument(
            message("spheres of nodes of a body with ", name(kind_),
                    " bounds, which are boxes of a wide tree; allowed: exact, bd, nbd"));
    return spheres_->sphere(node);
}

Box PosedTree::whole() {
    if (!has_pose()) return empty_box();
    PosedNbdTree* spheres = nbd_tree();
    if (!spheres) {
        const PosedWideTree& boxes = wide_tree();
        boxes.require_finite();
        return boxes.whole();
    }
    const Sphere& root = spheres->sphere(0);
    spheres->require_finite();
    const Eigen::Array3f lo = root.c.array() - root.r, hi = root.c.array() + root.r;
    return {{lo[0], lo[1], lo[2], 0}, {hi[0], hi[1], hi[2], 0}};
}

int PosedTree::nodes_bounded() const noexcept {
    const std::optional<PosedWideTree>& wide = current_wide_tree();
    return (wide ? wide->bounded() : 0) + (spheres_ ? spheres_->bounded() : 0);
}

int PosedTree::nodes_out_of_range() const noexcept {
    const std::optional<PosedWideTree>& wide = current_wide_tree();
    return (wide ? wide->out_of_range() : 0) + (spheres_ ? spheres_->out_of_range() : 0);
}

BoundKind PosedTree::chosen() const noexcept {
    if (spheres_) return kind_;
    const bool by_positions = is_moved_by_positions();
    if (by_positions && (kind_ == BoundKind::affine || of_surface_->in_step())) return BoundKind::boxes;
    return kind_ == BoundKind::automatic ? bounds_of_auto(*tree_, !by_positions, margin_) : kind_;
}

const WideTree* PosedTree::box_tree() const noexcept {
    return is_box(kind_) && kind_ != BoundKind::automatic ? &current_wide_tree()->tree() : nullptr;
}

void PosedTree::require_finite() const {
    if (spheres_) spheres_->require_finite();
    for (const auto* wide : {&of_nodes_, &of_surface_})
        if (*wide) (*wide)->require_finite();
}

PosedTree::WideRoom PosedTree::wide_room() const noexcept {
    const int clusters = tree_->boxes ? tree_->boxes->tree().clusters() : most_clusters(tree_->faces.rows());
    WideRoom room{(clusters + tree_width - 1) / tree_width, 0};
    for (const auto* wide : {&of_nodes_, &of_surface_})
        if (*wide)
            room = {std::max(room.packs, (*wide)->cluster_packs()),
                    std::max(room.leaves, (*wide)->tree().leaves())};
    return room;
}

}  // namespace nbd
