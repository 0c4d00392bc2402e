#pragma once

#include "sim/fem/step_system.hpp"

namespace nbd {

struct StepReport {
    int newton_iterations = 0;
    /// Impulse by which the equations of motion of the free nodes are off at the end of the step, over the
    /// norm of the system's right-hand side.
    double residual = 0;
    ElementReport elements;  // at the end of the step
};

/// Advances a lone body by one backward Euler step of dt seconds: state becomes the end of the step.
/// newton_iterations >= 1 is the number of linear solves; the first is linearised at x + dt v.
/// Stops earlier where the residual falls below `tolerance`. Throws std::invalid_argument on bad arguments,
/// std::runtime_error where the system cannot be factorised or the step ends at positions that are not
/// finite; `state` is then unchanged.
StepReport backward_euler_step(StepSystem& system, BodyState& state, double dt, const Loads& loads = {},
                               const PrescribedNodes& prescribed = {}, int newton_iterations = 1,
                               double tolerance = 1e-10);

/// Kinetic energy, joules. v: [N, 3].
double kinetic_energy(const ElasticBody& body, NodesRef v);

/// Sum of M v, kg m/s.
Eigen::Vector3d linear_momentum(const ElasticBody& body, NodesRef v);

/// Sum of x cross M v about the origin, kg m2/s.
Eigen::Vector3d angular_momentum(const ElasticBody& body, NodesRef x, NodesRef v);

}  // namespace nbd
