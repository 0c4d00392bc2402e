#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "sim/contact/contact_solver.hpp"
#include "sim/fem/momentum.hpp"
#include "sim/world/step_equations.hpp"
#include "sim/world/world_state.hpp"

namespace nbd {

/// How much of the momentum that a solve has missed bodies may be given at the end of a part. Arms that turn
/// in it, and straight ways that lead rigid bodies to their least axis of inertia, about which a momentum has
/// the most energy, must not make any. Bodies that touch or are joined get it as a whole, so that momentum
/// stays.
class EnergyBudget {
 public:
    /// Whether a world has bodies that it limits: rigid ones or jointed ones.
    static bool limits(const WorldState& world);
    /// At the start of a part that v solves, before the bodies advance.
    EnergyBudget(const WorldState& world, const StepEquations& equations, const Eigen::VectorXd& v);

    /// What loads give to the momentum of a body in the part.
    void set_loads(int body, const Momentum& loads) { start_[body].loads = loads; }

    /// Shares of the gains that bodies may have, [0, 1] [bodies], after they have advanced. A group with free
    /// rigid bodies may have what leaves its energy no higher than the solve did, or than it was at the start
    /// with the work of loads and of held and jointed bodies that press, seen from the obstacle that it
    /// touches, or else from its centre of mass. A jointed body may have what it and a fall explain: where a
    /// motor or light links hold it, the impulses of joints are large, and what they leave is noise. gains:
    /// rigid motions, m/s and rad/s, [bodies]. touching: pairs that press.
    std::vector<double> shares(const WorldState& world, std::span<const RigidVector> gains,
                               std::span<const PairImpulse> touching) const;

 private:
    struct Start {
        double energy = 0;  // kinetic and elastic, joules
        Momentum momentum{}, loads{};
        Eigen::Vector3d mean_velocity{};  // in the part, m/s
        Eigen::Vector3d spin{};           // rad/s
        // Of obstacles that press: sums of normal impulses, N s, and of these times velocities.
        double pressed = 0;
        Eigen::Vector3d walls = Eigen::Vector3d::Zero();
    };
    struct Group;
    double share(const WorldState& world, const Group& group, std::span<const RigidVector> gains) const;

    std::vector<Start> start_;  // [bodies]
};

}  // namespace nbd
