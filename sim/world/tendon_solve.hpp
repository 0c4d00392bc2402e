#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "sim/world/gases.hpp"
#include "sim/world/step_equations.hpp"
#include "sim/world/world_state.hpp"

namespace nbd {

/// The tendons in a part of a step. Such a cord is a spring of one unknown, its tension, that all of its
/// parts share. It is solved for beside the system, see Secant.
class TendonSolve {
 public:
    /// At the start of a part: none of `count` tendons has a tension.
    void begin(std::size_t count) { tensions_.setZero(static_cast<Eigen::Index>(count)); }
    /// Sets the bonds of tendons, with the tensions that were solved for last.
    void bind(const WorldState& world, std::vector<Bond>& bonds);
    /// Solves the systems of the step with the tensions that tendons, and the pressures that gases have at
    /// its solution. v: in and out.
    ContactSolveReport solve(WorldState& world, StepEquations& equations, GasSolve& gases,
                             Eigen::VectorXd& v);

 private:
    double taut_tension(const WorldState& world, std::size_t tendon, std::span<const Nodes> x) const;
    void pull(const WorldState& world, const Eigen::VectorXd& tensions, std::vector<Bond>& bonds);
    Eigen::MatrixXd first_response(const WorldState& world, const StepEquations& equations) const;

    std::vector<double> stiffness_;  // [tendons] in the part, N/m
    Eigen::VectorXd tensions_;       // [tendons] that bonds have, newtons
};

}  // namespace nbd
