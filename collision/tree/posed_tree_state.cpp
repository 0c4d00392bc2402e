#include "collision/tree/posed_tree_state.hpp"

#include <utility>

#include "collision/base/stopwatch.hpp"
#include "collision/tree/make_bounds.hpp"
#include "collision/tree/make_wide.hpp"

namespace nbd {

PosedTreeState::PosedTreeState(std::shared_ptr<const CollisionTree> body, BoundKind bounds,
                               std::optional<float> growth)
    : tree(std::move(body)), kind(bounds), margin(growth) {
    const bool is_auto = kind == BoundKind::automatic;
    if (tree->affine && (kind == BoundKind::affine || is_auto)) of_nodes.emplace(tree->affine);
    if (kind == BoundKind::boxes || is_auto || (kind == BoundKind::learned_affine && tree->learned_affine))
        of_surface.emplace(make_wide(*tree, kind, margin));
    if (is_auto && is_usable(*tree, BoundKind::learned_affine, margin))
        of_samples.emplace(make_wide(*tree, BoundKind::learned_affine, margin));
    if (is_auto && (of_samples || is_usable(*tree, BoundKind::learned_boxes, margin))) automatic.emplace();
    is_wide = of_nodes || of_surface;
    if (!is_wide) made_spheres();
    is_of_nodes = of_nodes.has_value();  // before the first pose too
}

AffineBoxes& PosedTreeState::wide() {
    if (is_of_nodes) return *of_nodes;
    if (asks_learned) {
        if (samples_are_stale) {
            const Stopwatch watch;
            positions.require_all();
            of_samples->begin_pose(VertexView(positions.rows()));
            samples_are_stale = false;
            automatic->learned_trial.start_ns = 1e9 * watch.seconds();
        }
        return *of_samples;
    }
    if (wide_is_stale) {
        const Stopwatch watch;
        positions.require_all();
        if (!of_surface) of_surface.emplace(make_wide(*tree, kind, margin));
        of_surface->begin_pose(VertexView(positions.rows()));
        wide_is_stale = false;
        if (automatic) automatic->boxes_trial.start_ns = 1e9 * watch.seconds();
    }
    return *of_surface;
}

PosedSpheres& PosedTreeState::made_spheres() {
    if (!posed_spheres) posed_spheres = make_spheres(*tree, kind, margin);
    return *posed_spheres;
}

PosedSpheres& PosedTreeState::spheres() {
    made_spheres();
    if (spheres_are_stale) {
        const Stopwatch watch;
        if (is_of_nodes) {
            of_nodes->make_surface(surface);
            positions = surface;
        }
        if (std::holds_alternative<ExactBoxes>(posed_spheres->bounds)) positions.require_all();
        posed_spheres->begin_pose(positions, {});
        spheres_are_stale = false;
        if (automatic && !of_samples) automatic->learned_trial.start_ns = 1e9 * watch.seconds();
    }
    return *posed_spheres;
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

}  // namespace nbd
