#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <stdexcept>
#include <utility>

#include "sim/world/world.hpp"
#include "tests/support/box_body.hpp"

namespace nbd::test {

/// Steps of backward Euler without gravity that are never cut and whose linear systems are factorised, so
/// that their solution is exact to rounding.
inline WorldConfig exact_steps(int newton_iterations = 1, double newton_tolerance = 1e-10) {
    WorldConfig config{.gravity = Eigen::Vector3d::Zero()};
    config.limits.stretch = std::numeric_limits<double>::infinity();
    config.linear = {.solver = LinearSolver::direct, .tolerance = 1e-11};
    config.step = {.integrator = TimeIntegrator::backward_euler,
                   .newton_iterations = newton_iterations,
                   .newton_tolerance = newton_tolerance,
                   .max_substeps = 1};
    return config;
}

/// A world that holds one body and nothing to touch. The body must outlive it.
class OneBodyWorld {
 public:
    explicit OneBodyWorld(const ElasticBody& body, const WorldConfig& config = exact_steps(),
                          BodyState start = {}, std::vector<Grip> grips = {})
        : world_(config) {
        Body surface = boundary_body(body.rest());
        world_.add_body({.elastic = std::shared_ptr<const ElasticBody>(std::shared_ptr<void>(), &body),
                         .W = std::move(surface.W),
                         .F = std::move(surface.surface.F),
                         .state = std::move(start),
                         .grips = std::move(grips)});
    }

    /// Throws std::runtime_error where the step fails or is rejected.
    void step(double dt) {
        const WorldReport report = world_.step(dt);
        if (!report.rejection.empty() || !report.failure.empty())
            throw std::runtime_error(report.failure.empty() ? report.rejection : report.failure);
    }
    void steps(int count, double dt) {
        for (int s = 0; s < count; ++s) step(dt);
    }

    World& world() noexcept { return world_; }
    const BodyState& state() const { return world_.state(0); }

 private:
    World world_;
};

/// Norm of the impulse by which the step from `start` to the positions of `end` violates the equations of
/// motion at the nodes that are not held, relative to the momentum and impulses of the step. Written out term
/// by term, as a check on the solver's own residual. The velocities are those of the way: World turns those
/// of `end` to keep the angular momentum.
inline double step_residual(const ElasticBody& body, const BodyState& start, const BodyState& end, double dt,
                            const Loads& loads = {}, const std::vector<int>& held = {}) {
    const Material& material = body.material();
    ElementPose pose;
    ElementForces forces;
    body.pose(end.x, pose, forces);
    const Nodes v = (end.x - start.x) / dt;
    Nodes elastic(v.rows(), 3), damping(v.rows(), 3);
    const auto mass = body.node_masses().asDiagonal();
    const Nodes inertia = mass * ((1 + dt * material.rayleigh_mass) * v - start.v);
    body.sum_forces(forces, elastic);
    const StepMotion motion{.w = v, .dt = dt, .strain_rate_at = 0.5, .damping = 1};
    body.pose(end.x, pose, forces, Tangent::rotated, &motion);
    body.damping_product(pose, v, forces, damping);
    Nodes outer = body.node_masses() * loads.gravity.transpose();
    if (loads.forces.rows() > 0) outer += loads.forces;
    Nodes off = inertia - dt * (elastic + outer - material.rayleigh_stiffness * damping);
    Nodes momentum = mass * start.v;
    for (const int node : held)
        for (Nodes* part : {&off, &momentum, &elastic, &outer}) part->row(node).setZero();
    return off.norm() / (momentum.norm() + dt * (elastic.norm() + outer.norm()));
}

/// Displacements of a body at rest under loads, [N, 3], metres. The nodes `held` keep their rest positions,
/// or get the displacements `held_at`, [held, 3]. The steps are so long that inertia vanishes. One step with
/// one iteration is linear elasticity; more of both, each with its share of the load, follow the body into
/// large displacements.
inline Nodes static_displacements(const ElasticBody& body, const std::vector<int>& held, const Loads& loads,
                                  const Nodes& held_at = {}, int load_steps = 1, int newton_iterations = 1) {
    const double dt = 1e5;
    std::vector<Grip> grips;
    for (std::size_t k = 0; k < held.size(); ++k) {
        grips.push_back({.nodes = {held[k]}});
        if (held_at.size() > 0) grips.back().motion = eased({.translation = held_at.row(k)});
    }
    Nodes forces = body.node_masses() * loads.gravity.transpose();
    if (loads.forces.rows() > 0) forces += loads.forces;
    // Rounding alone leaves more than exact_steps() allows where a large body is held at one end.
    WorldConfig config = exact_steps(newton_iterations, 1e-8);
    config.linear.tolerance = 1e-9;
    OneBodyWorld world(body, config, {}, grips);
    for (int step = 1; step <= load_steps; ++step) {
        world.world().forces(0) = static_cast<double>(step) / load_steps * forces;
        world.step(dt);
    }
    return world.state().x - body.rest().X;
}

}  // namespace nbd::test
