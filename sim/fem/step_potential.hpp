#pragma once

#include "sim/fem/step_system.hpp"

namespace nbd {

/// One backward Euler step of a body as a minimisation over its end velocities v, [N, 3]. The gradient of
///
///   P(v) = 1/2 |v - v0|^2_M + E(x0 + dt v) - dt v.(M g + f_outer) + dt/2 (alpha |v|^2_M + beta |v|^2_K)
///
/// is the impulse balance that the step solves. Joules. Contact forces are not included.
class StepPotential {
 public:
    /// Stores references to all arguments. damping: elements that define the stiffness K of the damping term.
    StepPotential(const ElasticBody& body, const BodyState& start, double dt, const Loads& loads,
                  const ElementPose& damping)
        : body_(body), start_(start), dt_(dt), loads_(loads), damping_(damping) {}

    double value(const Nodes& v);

    /// [N, 3] newton seconds.
    Nodes gradient(const Nodes& v);

 private:
    const ElasticBody& body_;
    const BodyState& start_;
    double dt_;
    const Loads& loads_;
    const ElementPose& damping_;
    ElementPose end_;       // scratch
    ElementForces forces_;  // likewise
};

}  // namespace nbd
