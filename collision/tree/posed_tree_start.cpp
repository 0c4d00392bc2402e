// How a pose or a step starts, and what is checked of it.
#include <stdexcept>
#include <string>

#include "collision/base/message.hpp"
#include "collision/tree/make_bounds.hpp"
#include "collision/tree/make_wide.hpp"
#include "collision/tree/posed_tree_state.hpp"

namespace nbd {
namespace {

/// Throws std::invalid_argument, naming the first row, if a number is not finite.
void require_finite_rows(const char* what, const VertexView& x) {
    for (Eigen::Index i = 0; i < x.count(); ++i) {
        const auto row = x.rows().row(i);
        if (!row.allFinite())
            throw std::invalid_argument(message("position of ", what, " ", i, " is (", row.x(), ", ", row.y(),
                                                ", ", row.z(), "), allowed: finite numbers"));
    }
}

}  // namespace

template <class Start>
void PosedTreeState::begin(const Start& start) {
    try {
        start();
        require_finite();
    } catch (...) {
        forget_pose();
        throw;
    }
}

void PosedTreeState::begin_pose(VertexView x) {
    begin([&] {
        check_rows("positions", x);
        given = x;
        given_nodes = false;
        set_pose(Positions(x));
    });
}

void PosedTreeState::begin_pose(EmbeddedPositions& x) {
    begin([&] {
        if (x.vertex_count() != tree->vertex_count)
            throw std::invalid_argument(message("embedded positions: of ", x.vertex_count(),
                                                " vertices, but the surface has ", tree->vertex_count));
        if (of_nodes) return begin_pose_of_nodes(x.nodes());
        given = x.nodes();
        given_nodes = true;
        require_finite_rows("node", given);
        if (is_exact(kind)) x.compute_all();
        if (kind == BoundKind::bd) x.compute(tree->bd->modes.representatives);
        if (kind == BoundKind::nbd) x.compute(tree->nbd->modes.representatives);
        set_pose(Positions(x));
    });
}

void PosedTreeState::set_pose(const Positions& x) {
    positions = x;
    is_of_nodes = in_step = false;
    wide_is_stale = true;
    spheres_are_stale = is_wide;
    if (!is_wide) return made_spheres().begin_pose(x);
    wide();
}

void PosedTreeState::begin_pose_of_nodes(VertexView nodes) {
    begin([&] {
        check_nodes("nodes", nodes);
        given = nodes;
        given_nodes = true;
        of_nodes->begin_pose(nodes);
        is_of_nodes = spheres_are_stale = true;
        wide_is_stale = in_step = false;
    });
}

void PosedTreeState::begin_step(VertexView start, VertexView end) {
    begin([&] {
        check_rows("start", start);
        check_rows("end", end);
        given_start = start;
        given = end;
        given_nodes = false;
        if (!of_surface) of_surface.emplace(make_wide(*tree, of_positions(), margin));
        of_surface->begin_step(start, end);
        positions = end;
        in_step = spheres_are_stale = true;
        is_of_nodes = wide_is_stale = false;
    });
}

void PosedTreeState::begin_step_of_nodes(VertexView start, VertexView end) {
    begin([&] {
        check_nodes("start", start);
        check_nodes("end", end);
        given_start = start;
        given = end;
        given_nodes = true;
        of_nodes->begin_step(start, end);
        is_of_nodes = in_step = spheres_are_stale = true;
        wide_is_stale = false;
    });
}

void PosedTreeState::forget_pose() noexcept {
    given = given_start = {};
    positions = {};
    is_of_nodes = of_nodes.has_value();
    in_step = wide_is_stale = spheres_are_stale = false;
    for (auto* wide : {&of_nodes, &of_surface})
        if (*wide) (*wide)->forget_pose();
    posed_spheres.reset();  // they cannot forget a pose, but those that are made anew have none
}

bool PosedTreeState::met_non_finite() const noexcept {
    if (is_of_nodes && of_nodes->met_non_finite()) return true;
    if (!is_of_nodes && !wide_is_stale && of_surface && of_surface->met_non_finite()) return true;
    return !spheres_are_stale && posed_spheres && posed_spheres->met_non_finite();
}

void PosedTreeState::require_finite() const {
    if (!met_non_finite()) return;
    const char* what = given_nodes ? "node" : "vertex";
    if (in_step) require_finite_rows(what, given_start);
    require_finite_rows(what, given);
    // Finite, but bounds around them overflow, and are near everything.
}

void PosedTreeState::check_rows(const char* what, const VertexView& x) const {
    if (x.count() != tree->vertex_count)
        throw std::invalid_argument(
            message(what, ": ", x.count(), " rows, but the surface has ", tree->vertex_count, " vertices"));
}

void PosedTreeState::check_nodes(const char* what, const VertexView& x) const {
    if (!of_nodes)
        throw std::invalid_argument(
            message("poses of nodes need affine or auto bounds and a tree that hangs on nodes; these are ",
                    name(kind), tree->affine ? "" : ", of a tree that does not"));
    if (x.count() != tree->affine->node_count())
        throw std::invalid_argument(message(what, ": ", x.count(), " rows, but the surface hangs on ",
                                            tree->affine->node_count(), " nodes"));
}

}  // namespace nbd
