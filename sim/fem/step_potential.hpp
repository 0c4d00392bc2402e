#pragma once

#include "sim/fem/step_system.hpp"

namespace nbd {

/// One step of a body (see TimeStep) as a minimisation over its unknown v, [N, 3]. The gradient of
///
///   P(v) = 1/2 |c v - v*|^2_M + E(x* + dt v) - dt v.(M g + f_outer) + c dt/2 (alpha |v|^2_M + beta |v|^2_D)
///
/// is the impulse balance that the step solves. Joules, up to a constant. Contact forces are not included.
class StepPotential {
 public:
    /// Stores references to all arguments but the step. damping: elements of the step, which define the
    /// damping matrix D.
    StepPotential(const ElasticBody& body, const BodyState& start, const TimeStep& step, const Loads& loads,
                  const ElementPose& damping)
        : body_(body), start_(start), step_(step), loads_(loads), damping_(damping) {}

    double value(const Nodes& v);

    /// [N, 3] newton seconds.
    Nodes gradient(const Nodes& v);

 private:
    const ElasticBody& body_;
    const BodyState& start_;
    TimeStep step_;
    const Loads& loads_;
    const ElementPose& damping_;
    ElementPose end_;       // scratch
    ElementForces forces_;  // likewise
};

}  // namespace nbd
