#include "collision/tree/posed_tree.hpp"

#include <cmath>
#include <stdexcept>
#include <type_traits>
#include <utility>

#include "collision/base/message.hpp"
#include "collision/tree/make_bounds.hpp"
#include "collision/tree/posed_tree_state.hpp"

namespace nbd {

PosedTree::PosedTree(std::shared_ptr<const CollisionTree> tree, BoundKind kind, std::optional<float> margin) {
    if (!tree) throw std::invalid_argument("a posed tree needs a collision tree, got none");
    if (margin && !(*margin >= 0 && std::isfinite(*margin)))
        throw std::invalid_argument(message("margin is ", *margin, ", allowed: finite and 0 or more"));
    if (margin.value_or(0.f) > 0 && (kind == BoundKind::boxes || kind == BoundKind::affine))
        throw std::invalid_argument(message("margin is ", *margin, ", but exact boxes take none"));
    check_collision_tree(*tree);
    check_calibrated(*tree, kind, margin);
    state_ = std::make_unique<PosedTreeState>(std::move(tree), kind, margin);
}

PosedTree::PosedTree(PosedTree&&) noexcept = default;
PosedTree& PosedTree::operator=(PosedTree&&) noexcept = default;
PosedTree::~PosedTree() = default;

void PosedTree::begin_pose(VertexView x) { state_->begin_pose(x); }

void PosedTree::begin_pose(EmbeddedPositions& x) { state_->begin_pose(x); }

void PosedTree::begin_pose_of_nodes(VertexView nodes) { state_->begin_pose_of_nodes(nodes); }

void PosedTree::begin_step(VertexView start, VertexView end) { state_->begin_step(start, end); }

void PosedTree::begin_step_of_nodes(VertexView start, VertexView end) {
    state_->begin_step_of_nodes(start, end);
}

void PosedTree::reserve() {
    for (auto* wide : {&state_->of_nodes, &state_->of_surface})
        if (*wide) (*wide)->reserve();
}

std::optional<Box> PosedTree::box(int node) {
    return std::visit(
        [node](auto& bounds) -> std::optional<Box> {
            if constexpr (BoxBound<std::remove_cvref_t<decltype(bounds)>>)
                return bounds.box(node);
            else
                return std::nullopt;
        },
        state_->spheres().bounds);
}

const Sphere& PosedTree::sphere(int node) {
    PosedSpheres& posed = state_->spheres();
    return std::visit([&](auto& bounds) -> const Sphere& { return posed.spheres.get(node, bounds); },
                      posed.bounds);
}

Box PosedTree::whole() {
    if (!state_->has_pose()) return empty_box();
    if (walk_wide_trees(*state_, *state_)) {
        const Box whole = state_->wide().whole();
        state_->require_finite();
        return whole;
    }
    const std::optional<Box> root_box = box(0);
    const Sphere& root = sphere(0);
    state_->require_finite();
    if (root_box) return *root_box;
    const Eigen::Array3f lo = root.c.array() - root.r, hi = root.c.array() + root.r;
    return {{lo[0], lo[1], lo[2], 0}, {hi[0], hi[1], hi[2], 0}};
}

std::optional<float> PosedTree::ood_score(int node) {
    PosedSpheres& posed = state_->spheres();
    if (state_->positions.rows().rows() == 0) return std::nullopt;
    return std::visit(
        [node](auto& bounds) -> std::optional<float> {
            if constexpr (GatedBound<std::remove_cvref_t<decltype(bounds)>>) {
                bounds.bound(node);
                return bounds.ood_score(node);
            } else {
                return std::nullopt;
            }
        },
        posed.bounds);
}

int PosedTree::nodes_bounded() const noexcept {
    const PosedTreeState& s = *state_;
    int count = 0;
    if (s.is_of_nodes)
        count = s.of_nodes->fitted();
    else if ((s.is_wide || s.in_step) && !s.wide_is_stale)
        count = s.of_surface->fitted();
    if (s.posed_spheres && !s.spheres_are_stale) count += s.posed_spheres->nodes_bounded();
    return count;
}

int PosedTree::nodes_out_of_range() const noexcept {
    const PosedTreeState& s = *state_;
    int count = 0;
    if (s.of_surface && !s.is_of_nodes && !s.wide_is_stale) count = s.of_surface->out_of_range();
    if (s.posed_spheres && !s.spheres_are_stale) count += s.posed_spheres->nodes_out_of_range();
    return count;
}

BoundKind PosedTree::chosen() const noexcept {
    const PosedTreeState& s = *state_;
    if (s.kind != BoundKind::automatic) return s.kind;
    return s.goes_wide ? bounds_of_auto(*s.tree, s.is_of_nodes, s.margin) : BoundKind::boxes;
}

const CollisionTree& PosedTree::tree() const noexcept { return *state_->tree; }

const WideTree* PosedTree::box_tree() const noexcept {
    const PosedTreeState& s = *state_;
    if (!s.is_wide || s.kind == BoundKind::automatic) return nullptr;
    if (s.is_of_nodes) return &s.of_nodes->tree();
    return s.of_surface ? &s.of_surface->tree() : nullptr;
}

BoundKind PosedTree::kind() const noexcept { return state_->kind; }

}  // namespace nbd
