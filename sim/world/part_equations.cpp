// The linear systems of a part of a step, what is prescribed in it, and how far from balance an iterate is.
#include <algorithm>
#include <limits>

#include "meshing/parallel/parallel_for.hpp"
#include "sim/fem/step_system.hpp"
#include "sim/world/joint_forces.hpp"
#include "sim/world/part_solve.hpp"
#include "sim/world/step_loads.hpp"
#include "sim/world/time_rule.hpp"

namespace nbd {

/// The unknowns of all bodies, with the given velocities in place.
Eigen::VectorXd PartSolve::stacked(Nodes (*velocities)(const WorldState&, const SteppedBody&),
                                   const std::vector<PrescribedNodes>& given) const {
    Eigen::VectorXd v(world_.first_unknown.back());
    for (std::size_t b = 0; b < world_.bodies.size(); ++b) {
        Eigen::Map<Nodes> part(v.data() + world_.first_unknown[b], world_.bodies[b].state.v.rows(), 3);
        part = velocities(world_, world_.bodies[b]);
        part(given[b].nodes, Eigen::all) = given[b].v;
    }
    return v;
}

/// The bonds of joints as seen from the iterate v.
void PartSolve::find_bonds(const Eigen::VectorXd& v) {
    equations_.bonds = bonds_at(world_, v, caught_);
    if (!world_.tendons.empty()) tendons_.bind(world_, equations_.bonds);
}

/// iterate: velocities to linearise at; null: as the bodies went before the step.
void PartSolve::build_systems(const std::vector<PrescribedNodes>& given, const Eigen::VectorXd* iterate,
                              Tangent tangent) {
    gases_.clear();
    std::vector<Nodes> at;
    for (int b = 0; b < world_.body_count(); ++b) {
        SteppedBody& body = world_.at(b);
        const Nodes& w = at.emplace_back(iterate ? world_.part_of(b, *iterate) : first_iterate(world_, body));
        set_end_forces(world_, body, body.start.x + dt_ * w);
        linearise_loads(world_, body, w);
        gases_.linearise(world_, b, w);
    }
    const auto assemble = [&](int b) {
        const SteppedBody& body = world_.at(b);
        StepSystem& system = equations_.systems[b];
        // What pulls at a rigid body is far beyond its weight, so that an iteration needs how that turns with
        // it.
        const bool is_full = body.elastic->is_rigid() && iterate && tangent == Tangent::rotated;
        system.assemble(body.start, world_.step_of(body), end_loads(world_, body), at[b],
                        is_full ? Tangent::full : tangent);
        add_tangents(world_, body, at[b], system);
        system.prescribe(given[b]);
    };
    parallel_for(world_.body_count(), assemble, 1);
}

/// Norm of the residual impulse at v of the body that is farthest from balance, relative to its scale, see
/// ContactSolver::share_of_scales(); 0 where rounding alone leaves as much.
double PartSolve::residual(const Eigen::VectorXd& v) {
    equations_.solver.linearise(v);
    constexpr double unit = 4 * std::numeric_limits<double>::epsilon();
    Eigen::VectorXd off = -equations_.solver.impulses(v), rounding = Eigen::VectorXd::Zero(v.size());
    for (int b = 0; b < world_.body_count(); ++b) {
        const StepSystem& system = equations_.systems[b];
        set_end_forces(world_, world_.at(b), world_.at(b).start.x + dt_ * world_.part_of(b, v));
        linearise_loads(world_, world_.at(b), world_.part_of(b, v));
        const Loads outer = end_loads(world_, world_.at(b));
        const Nodes own = StepPotential(*world_.at(b).elastic, world_.at(b).start, equations_.steps[b], outer,
                                        system.elements())
                              .gradient(world_.part_of(b, v));
        Eigen::Map<Nodes>(off.data() + world_.first_unknown[b], own.rows(), 3) += own;
        const auto& diagonal = system.matrix().diagonal();
        for (int i = 0; i < own.rows(); ++i) {
            const int first = world_.first_unknown[b] + 3 * i;
            const double motion = v.segment<3>(first).norm() + world_.at(b).start.x.row(i).norm() / dt_;
            rounding.segment<3>(first).setConstant(2 * unit * diagonal[i].norm() * motion);
        }
    }
    return equations_.solver.share_of_scales(off, rounding);
}

}  // namespace nbd
