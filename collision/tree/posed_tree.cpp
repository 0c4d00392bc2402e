#include "collision/tree/posed_tree.hpp"

#include <cassert>
#include <cmath>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>

#include "collision/base/message.hpp"
#include "collision/tree/posed_tree_state.hpp"

namespace nbd {
namespace {

using Bounds = decltype(PosedTreeState::bounds);

Bounds make_bounds(const CollisionTree& tree, BoundKind kind, const NodeMargins& margins) {
    if (kind == BoundKind::exact) return ExactBound(tree.spheres);
    if (kind == BoundKind::boxes) return ExactBoxes(tree.spheres);
    if (kind == BoundKind::bd && tree.bd) return BdBound(tree.spheres, *tree.bd);
    if (kind == BoundKind::nbd && tree.nbd) return NbdBound(tree.spheres, *tree.nbd);
    if (kind == BoundKind::learned_spheres && tree.learned) return LearnedSpheres(*tree.learned);
    if (kind == BoundKind::learned_boxes && has_bounds(tree, kind))
        return LearnedBoxes(tree.spheres, *tree.learned, margins);
    if (kind == BoundKind::certified && tree.certified) return CertifiedBound(tree.spheres, *tree.certified);
    if (kind == BoundKind::automatic)
        return AutoBoxes(tree.spheres, tree.learned ? &*tree.learned : nullptr, margins);
    std::string available = "exact";
    for (const BoundKind other : bound_kinds)
        if (other != BoundKind::exact && has_bounds(tree, other)) available.append(", ").append(name(other));
    throw std::invalid_argument(
        message("the collision tree has no model for \"", name(kind), "\" bounds, only for ", available));
}

NodeMargins no_margins(const CollisionTree& tree) {
    return {std::vector<float>(tree.spheres.nodes.size(), 0.f), {}};
}

NodeMargins node_margins(const CollisionTree& tree, BoundKind kind, std::optional<float> margin) {
    const auto calibration =
        tree.calibrations.find(kind == BoundKind::automatic ? BoundKind::learned_boxes : kind);
    if (margin || calibration == tree.calibrations.end())
        return {std::vector<float>(tree.spheres.nodes.size(), margin.value_or(0.f)), {}};
    return {calibration->second.margins, calibration->second.limits};
}

}  // namespace

PosedTree::PosedTree(std::shared_ptr<const CollisionTree> tree, BoundKind kind, std::optional<float> margin) {
    if (!tree) throw std::invalid_argument("a posed tree needs a collision tree, got none");
    if (margin && !(*margin >= 0 && std::isfinite(*margin)))
        throw std::invalid_argument(message("margin is ", *margin, ", allowed: finite and 0 or more"));
    if (margin.value_or(0.f) > 0 && kind == BoundKind::boxes)
        throw std::invalid_argument(message("margin is ", *margin, ", but exact boxes take none"));
    check_collision_tree(*tree);
    const CollisionTree& t = *tree;
    const NodeMargins margins = node_margins(t, kind, margin);
    state_ = std::make_unique<PosedTreeState>(
        PosedTreeState{std::move(tree), kind, make_bounds(t, kind, margins),
                       SphereCache(t.spheres, is_box(kind) ? no_margins(t) : margins), LeafBoxes(t)});
}

PosedTree::PosedTree(PosedTree&&) noexcept = default;
PosedTree& PosedTree::operator=(PosedTree&&) noexcept = default;
PosedTree::~PosedTree() = default;

void PosedTree::begin_pose(VerticesRef x, std::span<const RegionMotion> motion) noexcept {
    assert(x.rows() == state_->tree->vertex_count);
    state_->begin_pose(x, motion);
}

void PosedTree::begin_pose(EmbeddedPositions& x, std::span<const RegionMotion> motion) noexcept {
    assert(x.vertex_count() == state_->tree->vertex_count);
    const CollisionTree& tree = *state_->tree;
    if (is_exact(state_->kind)) x.compute_all();
    if (state_->kind == BoundKind::bd) x.compute(tree.bd->modes.representatives);
    if (state_->kind == BoundKind::nbd) x.compute(tree.nbd->modes.representatives);
    state_->begin_pose(Positions(x), motion);
}

void PosedTreeState::begin_pose(const Positions& x, std::span<const RegionMotion> motion) noexcept {
    std::visit(
        [&](auto& b) {
            if constexpr (requires { b.begin_pose(x, motion); })
                b.begin_pose(x, motion);
            else if constexpr (requires { b.begin_pose(x); })
                b.begin_pose(x);
            else
                b.begin_pose(x.rows());
        },
        bounds);
    spheres.begin_pose(x);
    boxes.begin_pose(x);
}

std::optional<Box> PosedTree::box(int node) noexcept {
    return std::visit(
        [node](auto& bounds) -> std::optional<Box> {
            if constexpr (BoxBound<std::remove_cvref_t<decltype(bounds)>>)
                return bounds.box(node);
            else
                return std::nullopt;
        },
        state_->bounds);
}

const Sphere& PosedTree::sphere(int node) noexcept {
    return std::visit([&](auto& bounds) -> const Sphere& { return state_->spheres.get(node, bounds); },
                      state_->bounds);
}

std::optional<float> PosedTree::ood_score(int node) noexcept {
    return std::visit(
        [node](auto& bounds) -> std::optional<float> {
            if constexpr (GatedBound<std::remove_cvref_t<decltype(bounds)>>) {
                bounds.bound(node);
                return bounds.ood_score(node);
            } else {
                return std::nullopt;
            }
        },
        state_->bounds);
}

int PosedTree::nodes_bounded() const noexcept {
    return std::visit(
        [&](const auto& bounds) {
            if constexpr (requires { bounds.bounded(); })
                return bounds.bounded();
            else
                return state_->spheres.bounded();
        },
        state_->bounds);
}

int PosedTree::nodes_out_of_range() const noexcept {
    return std::visit(
        [&](const auto& bounds) {
            if constexpr (requires { bounds.out_of_range(); })
                return bounds.out_of_range();
            else
                return state_->spheres.out_of_range();
        },
        state_->bounds);
}

const CollisionTree& PosedTree::tree() const noexcept { return *state_->tree; }

BoundKind PosedTree::kind() const noexcept { return state_->kind; }

}  // namespace nbd
