#pragma once

#include <Eigen/Core>
#include <vector>

#include "sim/world/step_equations.hpp"
#include "sim/world/world_state.hpp"

// The cavities of bodies, and the gases in them.
namespace nbd {

/// Makes the cavities of a body that is being added, and takes the gases out of its loads. Throws
/// std::invalid_argument for a gas that is in no cavity, or the second in one.
void take_gases(SteppedBody& body, std::vector<BodyLoad>& loads);

/// Forces of gases on the nodes of a body at the positions x, [N, 3] newtons.
Nodes gas_forces(const SteppedBody& body, const Nodes& x, double time);

/// Of the gases of a body at the positions x at a time, joules.
double gas_energy(const SteppedBody& body, const Nodes& x, double time);

/// The largest of 1, 1/2, 1/4 ... of the way from v to `to` in which no cavity with a gas loses more than
/// half of its volume.
double share_of_cavities(const WorldState& world, const Eigen::VectorXd& v, const Eigen::VectorXd& to);

/// All cavities of bodies, as they are now.
std::vector<CavityState> cavity_states(const WorldState& world);

/// The gases in a part of a step. A gas is a spring of one unknown, its pressure, that all walls of a cavity
/// share. It is solved for beside the system, see Secant.
class GasSolve {
 public:
    void clear() { gases_.clear(); }
    /// Linearises the gases of a body at its unknown w.
    void linearise(const WorldState& world, int index, const Nodes& w);
    /// Solves the systems of the step with the pressures that gases have at its solution. v: in and out.
    ContactSolveReport solve(WorldState& world, StepEquations& equations, Eigen::VectorXd& v);
    /// By how much the pressures of gases at v are off those that were solved for, of their absolute ones or
    /// those at the start.
    double error(const WorldState& world, const Eigen::VectorXd& v) const;

 private:
    /// A gas, linearised at an iterate.
    struct StepGas {
        int body = 0;
        const ClosedGas* gas = nullptr;
        Nodes slope;                                     // of the volume, [N, 3] m2
        double volume = 0, pressure = 0, stiffness = 0;  // m3, Pa, Pa / m3
        double flow = 0;    // rate of the volume by the unknown of the iterate, m3/s
        double solved = 0;  // Pa, with which the systems are solved
    };
    Eigen::VectorXd pressures(const WorldState& world, const Eigen::VectorXd& v) const;
    void press(WorldState& world, const Eigen::VectorXd& pressures, std::vector<StepSystem>& systems);
    Eigen::MatrixXd first_response(const WorldState& world, const std::vector<StepSystem>& systems) const;

    std::vector<StepGas> gases_;  // of all bodies
};

}  // namespace nbd
