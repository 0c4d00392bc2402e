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

using Bounds = decltype(PosedSpheres::bounds);

Bounds make_bounds(const CollisionTree& tree, BoundKind kind, const NodeMargins& margins) {
    if (kind == BoundKind::exact) return ExactBound(tree.spheres);
    if (kind == BoundKind::boxes || (kind == BoundKind::affine && tree.affine))
        return ExactBoxes(tree.spheres);
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

std::unique_ptr<PosedSpheres> make_spheres(const CollisionTree& tree, BoundKind kind,
                                           std::optional<float> margin) {
    const NodeMargins margins = node_margins(tree, kind, margin);
    return std::make_unique<PosedSpheres>(
        PosedSpheres{make_bounds(tree, kind, margins),
                     SphereCache(tree.spheres, is_box(kind) ? no_margins(tree) : margins), LeafBoxes(tree)});
}

}  // namespace

PosedTree::PosedTree(std::shared_ptr<const CollisionTree> tree, BoundKind kind, std::optional<float> margin) {
    if (!tree) throw std::invalid_argument("a posed tree needs a collision tree, got none");
    if (margin && !(*margin >= 0 && std::isfinite(*margin)))
        throw std::invalid_argument(message("margin is ", *margin, ", allowed: finite and 0 or more"));
    if (margin.value_or(0.f) > 0 && (kind == BoundKind::boxes || kind == BoundKind::affine))
        throw std::invalid_argument(message("margin is ", *margin, ", but exact boxes take none"));
    check_collision_tree(*tree);
    state_ = std::make_unique<PosedTreeState>(PosedTreeState{std::move(tree), kind, nullptr});
    const CollisionTree& body = *state_->tree;
    if (kind == BoundKind::affine && body.affine)
        state_->wide.emplace(body.affine);
    else if (kind == BoundKind::boxes)
        state_->wide.emplace(body.boxes ? body.boxes : make_boxes(body));
    else
        state_->posed_spheres = make_spheres(*state_->tree, kind, margin);
}

PosedTree::PosedTree(PosedTree&&) noexcept = default;
PosedTree& PosedTree::operator=(PosedTree&&) noexcept = default;
PosedTree::~PosedTree() = default;

void PosedTree::begin_pose(VerticesRef x, std::span<const RegionMotion> motion) noexcept {
    assert(x.rows() == state_->tree->vertex_count);
    if (state_->kind == BoundKind::boxes) return begin_pose_of_boxes(x);
    state_->is_of_nodes = state_->is_stale = false;
    state_->spheres().begin_pose(x, motion);
}

void PosedTree::begin_pose(EmbeddedPositions& x, std::span<const RegionMotion> motion) noexcept {
    assert(x.vertex_count() == state_->tree->vertex_count);
    const CollisionTree& tree = *state_->tree;
    if (is_exact(state_->kind)) x.compute_all();
    if (state_->kind == BoundKind::boxes) return begin_pose_of_boxes(x.rows());
    if (state_->wide) return begin_pose_of_nodes(x.nodes());
    if (state_->kind == BoundKind::bd) x.compute(tree.bd->modes.representatives);
    if (state_->kind == BoundKind::nbd) x.compute(tree.nbd->modes.representatives);
    state_->posed_spheres->begin_pose(Positions(x), motion);
}

void PosedTree::begin_pose_of_nodes(VerticesRef nodes) noexcept {
    assert(state_->kind == BoundKind::affine && nodes.rows() == state_->tree->affine->node_count());
    state_->wide->begin_pose(nodes);
    state_->is_of_nodes = state_->is_stale = true;
}

void PosedTree::begin_pose_of_boxes(const Positions& x) noexcept {
    state_->wide->begin_pose(x.rows());
    state_->positions = x;
    state_->is_stale = true;
}

PosedSpheres& PosedTreeState::spheres() noexcept {
    if (!posed_spheres) posed_spheres = make_spheres(*tree, kind, {});
    if (std::exchange(is_stale, false)) {
        if (kind == BoundKind::affine) {
            wide->make_surface(surface);
            positions = surface;
        }
        posed_spheres->begin_pose(positions, {});
    }
    return *posed_spheres;
}

void PosedSpheres::begin_pose(const Positions& x, std::span<const RegionMotion> motion) noexcept {
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

int PosedSpheres::nodes_bounded() const noexcept {
    return std::visit(
        [&](const auto& b) {
            if constexpr (requires { b.bounded(); })
                return b.bounded();
            else
                return spheres.bounded();
        },
        bounds);
}

int PosedSpheres::nodes_out_of_range() const noexcept {
    return std::visit(
        [&](const auto& b) {
            if constexpr (requires { b.out_of_range(); })
                return b.out_of_range();
            else
                return spheres.out_of_range();
        },
        bounds);
}

std::optional<Box> PosedTree::box(int node) noexcept {
    return std::visit(
        [node](auto& bounds) -> std::optional<Box> {
            if constexpr (BoxBound<std::remove_cvref_t<decltype(bounds)>>)
                return bounds.box(node);
            else
                return std::nullopt;
        },
        state_->spheres().bounds);
}

const Sphere& PosedTree::sphere(int node) noexcept {
    PosedSpheres& posed = state_->spheres();
    return std::visit([&](auto& bounds) -> const Sphere& { return posed.spheres.get(node, bounds); },
                      posed.bounds);
}

Box PosedTree::whole() noexcept {
    if (const AffineBoxes* wide = state_->wide_pose()) return wide->whole();
    if (const auto root = box(0)) return *root;
    const Sphere& root = sphere(0);
    const Eigen::Array3f lo = root.c.array() - root.r, hi = root.c.array() + root.r;
    return {{lo[0], lo[1], lo[2], 0}, {hi[0], hi[1], hi[2], 0}};
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
        state_->spheres().bounds);
}

int PosedTree::nodes_bounded() const noexcept {
    const int fitted = state_->wide_pose() ? state_->wide->fitted() : 0;
    const bool has_spheres = state_->posed_spheres && !state_->is_stale;
    return fitted + (has_spheres ? state_->posed_spheres->nodes_bounded() : 0);
}

int PosedTree::nodes_out_of_range() const noexcept {
    return state_->posed_spheres && !state_->is_stale ? state_->posed_spheres->nodes_out_of_range() : 0;
}

const CollisionTree& PosedTree::tree() const noexcept { return *state_->tree; }

BoundKind PosedTree::kind() const noexcept { return state_->kind; }

}  // namespace nbd
