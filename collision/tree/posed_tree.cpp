#include "collision/tree/posed_tree.hpp"

#include <cassert>
#include <cmath>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>

#include "collision/base/message.hpp"
#include "collision/base/stopwatch.hpp"
#include "collision/tree/make_wide.hpp"
#include "collision/tree/posed_tree_state.hpp"

namespace nbd {
namespace {

using Bounds = decltype(PosedSpheres::bounds);

Bounds make_bounds(const CollisionTree& tree, BoundKind kind, const NodeMargins& margins) {
    if (kind == BoundKind::exact) return ExactBound(tree.spheres);
    if (kind == BoundKind::boxes || (kind == BoundKind::affine && tree.affine) ||
        (kind == BoundKind::learned_affine && tree.learned_affine) ||
        (kind == BoundKind::automatic && !has_bounds(tree, BoundKind::learned_boxes)))
        return ExactBoxes(tree.spheres);
    if (kind == BoundKind::bd && tree.bd) return BdBound(tree.spheres, *tree.bd);
    if (kind == BoundKind::nbd && tree.nbd) return NbdBound(tree.spheres, *tree.nbd);
    if (kind == BoundKind::learned_spheres && tree.learned) return LearnedSpheres(*tree.learned);
    if ((kind == BoundKind::learned_boxes || kind == BoundKind::automatic) &&
        has_bounds(tree, BoundKind::learned_boxes))
        return LearnedBoxes(tree.spheres, *tree.learned, margins);
    if (kind == BoundKind::certified && tree.certified) return CertifiedBound(tree.spheres, *tree.certified);
    std::string available = "exact";
    for (const BoundKind other : bound_kinds)
        if (other != BoundKind::exact && has_bounds(tree, other)) available.append(", ").append(name(other));
    throw std::invalid_argument(
        message("the collision tree has no model for \"", name(kind), "\" bounds, only for ", available));
}

NodeMargins no_margins(const CollisionTree& tree) {
    return {std::vector<float>(tree.spheres.nodes.size(), 0.f), {}};
}

std::unique_ptr<PosedSpheres> make_spheres(const CollisionTree& tree, BoundKind kind,
                                           std::optional<float> margin) {
    const NodeMargins margins =
        kind == BoundKind::learned_affine ? no_margins(tree) : node_margins(tree, kind, margin);
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
    state_ = std::make_unique<PosedTreeState>(std::move(tree), kind, margin);
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
    if (state_->of_nodes) return begin_pose_of_nodes(x.nodes());
    const CollisionTree& tree = *state_->tree;
    if (is_exact(state_->kind)) x.compute_all();
    if (state_->kind == BoundKind::bd) x.compute(tree.bd->modes.representatives);
    if (state_->kind == BoundKind::nbd) x.compute(tree.nbd->modes.representatives);
    state_->begin_pose(Positions(x), motion);
}

void PosedTree::begin_pose_of_nodes(VerticesRef nodes) noexcept {
    assert(state_->of_nodes && nodes.rows() == state_->tree->affine->node_count());
    state_->begin_pose_of_nodes(nodes);
}

void PosedTree::begin_step(VerticesRef start, VerticesRef end) noexcept {
    assert(start.rows() == state_->tree->vertex_count && end.rows() == state_->tree->vertex_count);
    state_->begin_step(start, end);
}

void PosedTree::begin_step_of_nodes(VerticesRef start, VerticesRef end) noexcept {
    assert(state_->of_nodes);
    state_->begin_step_of_nodes(start, end);
}

PosedTreeState::PosedTreeState(std::shared_ptr<const CollisionTree> body, BoundKind bounds,
                               std::optional<float> growth)
    : tree(std::move(body)), kind(bounds), margin(growth) {
    const bool is_auto = kind == BoundKind::automatic;
    if (tree->affine && (kind == BoundKind::affine || is_auto)) of_nodes.emplace(tree->affine);
    if (kind == BoundKind::boxes || is_auto || (kind == BoundKind::learned_affine && tree->learned_affine))
        of_surface.emplace(make_wide(*tree, kind, margin));
    if (is_auto && tree->learned_affine)
        of_samples.emplace(make_wide(*tree, BoundKind::learned_affine, margin));
    if (is_auto && (of_samples || has_bounds(*tree, BoundKind::learned_boxes))) automatic.emplace();
    is_wide = of_nodes || of_surface;
    if (!is_wide) posed_spheres = make_spheres(*tree, kind, margin);
    is_of_nodes = of_nodes.has_value();  // before the first pose too
}

void PosedTreeState::begin_pose(const Positions& x, std::span<const RegionMotion> motion) noexcept {
    positions = x;
    is_of_nodes = in_step = false;
    wide_is_stale = samples_are_stale = spheres_are_stale = is_wide;
    if (!is_wide) return posed_spheres->begin_pose(x, motion);
    if (automatic)
        automatic->end_pose();
    else
        wide();
}

void PosedTreeState::begin_pose_of_nodes(VerticesRef nodes) noexcept {
    of_nodes->begin_pose(nodes);
    is_of_nodes = samples_are_stale = spheres_are_stale = true;
    wide_is_stale = in_step = false;
}

void PosedTreeState::begin_step(VerticesRef start, VerticesRef end) noexcept {
    if (!of_surface) of_surface.emplace(make_wide(*tree, kind, margin));
    of_surface->begin_step(start, end);
    positions = end;
    in_step = samples_are_stale = spheres_are_stale = true;
    is_of_nodes = wide_is_stale = false;
    if (automatic) automatic->end_pose();
}

void PosedTreeState::begin_step_of_nodes(VerticesRef start, VerticesRef end) noexcept {
    of_nodes->begin_step(start, end);
    is_of_nodes = in_step = samples_are_stale = spheres_are_stale = true;
    wide_is_stale = false;
}

AffineBoxes& PosedTreeState::wide() noexcept {
    if (is_of_nodes) return *of_nodes;
    if (asks_learned) {
        if (std::exchange(samples_are_stale, false)) {
            const Stopwatch watch;
            positions.require_all();
            of_samples->begin_pose(positions.rows());
            automatic->learned_trial.start_ns = 1e9 * watch.seconds();
        }
        return *of_samples;
    }
    if (std::exchange(wide_is_stale, false)) {
        const Stopwatch watch;
        positions.require_all();
        if (!of_surface) of_surface.emplace(make_wide(*tree, kind, margin));
        of_surface->begin_pose(positions.rows());
        if (automatic) automatic->boxes_trial.start_ns = 1e9 * watch.seconds();
    }
    return *of_surface;
}

PosedSpheres& PosedTreeState::spheres() noexcept {
    if (!posed_spheres) posed_spheres = make_spheres(*tree, kind, margin);
    if (std::exchange(spheres_are_stale, false)) {
        const Stopwatch watch;
        if (is_of_nodes) {
            of_nodes->make_surface(surface);
            positions = surface;
        }
        if (std::holds_alternative<ExactBoxes>(posed_spheres->bounds)) positions.require_all();
        posed_spheres->begin_pose(positions, {});
        if (automatic) automatic->learned_trial.start_ns = 1e9 * watch.seconds();
    }
    return *posed_spheres;
}

void AutoPose::add_trial(const AutoChoice::Trial& boxes, const AutoChoice::Trial& learned) noexcept {
    was_tried = true;
    for (const auto& [sum, trial] : {std::pair(&boxes_trial, &boxes), {&learned_trial, &learned}}) {
        sum->query_ns += trial->query_ns;
        sum->work += trial->work;
    }
}

void AutoPose::end_pose() noexcept {
    if (was_tried)
        choice.take_trial(boxes_trial, learned_trial);
    else if (boxes_work + learned_work > 0)
        choice.take_pose(boxes_work, learned_work);
    *this = {.choice = choice};
}

bool choose_bounds(PosedTreeState& a, PosedTreeState& b) noexcept {
    return choose_bounds(a, b,
                         may_be_learned(a) && may_be_learned(b) &&
                             learned_is_cheaper(a.automatic->choice, b.automatic->choice));
}

bool choose_bounds(PosedTreeState& a, PosedTreeState& b, bool learned) noexcept {
    a.asks_learned = b.asks_learned = learned;
    return a.goes_wide = b.goes_wide = a.has_wide() && b.has_wide();
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
    if (choose_bounds(*state_, *state_)) return state_->wide().whole();
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
    const PosedTreeState& s = *state_;
    int count = 0;
    if (s.is_of_nodes)
        count = s.of_nodes->fitted();
    else if ((s.is_wide || s.in_step) && !s.wide_is_stale)
        count = s.of_surface->fitted();
    if (s.of_samples && !s.samples_are_stale) count += s.of_samples->fitted();
    if (s.posed_spheres && !s.spheres_are_stale) count += s.posed_spheres->nodes_bounded();
    return count;
}

int PosedTree::nodes_out_of_range() const noexcept {
    const PosedTreeState& s = *state_;
    int count = 0;
    if (s.of_surface && !s.is_of_nodes && !s.wide_is_stale) count = s.of_surface->out_of_range();
    if (s.of_samples && !s.samples_are_stale) count += s.of_samples->out_of_range();
    if (s.posed_spheres && !s.spheres_are_stale) count += s.posed_spheres->nodes_out_of_range();
    return count;
}

BoundKind PosedTree::chosen() const noexcept {
    const PosedTreeState& s = *state_;
    if (s.kind != BoundKind::automatic) return s.kind;
    if (s.goes_wide && s.is_of_nodes) return BoundKind::affine;
    if (s.goes_wide) return s.asks_learned ? BoundKind::learned_affine : BoundKind::boxes;
    return has_bounds(*s.tree, BoundKind::learned_boxes) ? BoundKind::learned_boxes : BoundKind::boxes;
}

AutoChoice PosedTree::auto_choice() const noexcept {
    return state_->automatic ? state_->automatic->choice : AutoChoice();
}

void PosedTree::restore(const AutoChoice& choice) noexcept {
    if (!state_->automatic) return;
    *state_->automatic = {};
    state_->automatic->choice = choice;
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
