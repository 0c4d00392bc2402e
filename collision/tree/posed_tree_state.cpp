#include "collision/tree/posed_tree_state.hpp"

#include <utility>

#include "collision/tree/make_bounds.hpp"
#include "collision/tree/make_wide.hpp"

namespace nbd {

PosedTreeState::PosedTreeState(std::shared_ptr<const CollisionTree> body, BoundKind bounds,
                               std::optional<float> growth)
    : tree(std::move(body)), kind(bounds), margin(growth) {
    const bool is_auto = kind == BoundKind::automatic;
    if (tree->affine && (kind == BoundKind::affine || is_auto)) of_nodes.emplace(tree->affine);
    if (kind == BoundKind::boxes || is_auto || (kind == BoundKind::learned_affine && tree->learned_affine))
        of_surface.emplace(make_wide(*tree, of_positions(), margin));
    is_wide = of_nodes || of_surface;
    if (!is_wide) made_spheres();
    is_of_nodes = of_nodes.has_value();  // before the first pose too
}

AffineBoxes& PosedTreeState::wide() {
    if (is_of_nodes) return *of_nodes;
    if (wide_is_stale) {
        positions.require_all();
        if (!of_surface) of_surface.emplace(make_wide(*tree, of_positions(), margin));
        of_surface->begin_pose(VertexView(positions.rows()));
        wide_is_stale = false;
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
        if (is_of_nodes) {
            of_nodes->make_surface(surface);
            positions = surface;
        }
        if (std::holds_alternative<ExactBoxes>(posed_spheres->bounds)) positions.require_all();
        posed_spheres->begin_pose(positions);
        spheres_are_stale = false;
    }
    return *posed_spheres;
}

bool walk_wide_trees(PosedTreeState& a, PosedTreeState& b) noexcept {
    return a.goes_wide = b.goes_wide = a.has_wide() && b.has_wide();
}

}  // namespace nbd
