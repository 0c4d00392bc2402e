#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>

#include "sim/contact/contact_solver.hpp"
#include "sim/fem/step_system.hpp"
#include "sim/world/keyed.hpp"
#include "sim/world/statics.hpp"

namespace nbd {

/// Limits beyond which a simulation has failed.
struct FailureLimits {
    double inverted_share = 1;  // of the tetrahedra; crushed bodies recover, so the default allows all
    double stretch = 10;        // Frobenius norm of a deformation gradient
};

/// How steps advance bodies in time.
enum class TimeIntegrator {
    second_order,    // hardly damps; see TwoStepWeights
    backward_euler,  // damps vibrations, the more the fewer steps they take; a long step ends in balance
};

/// How steps are taken, and how accurately they solve their equations.
struct StepConfig {
    TimeIntegrator integrator = TimeIntegrator::second_order;
    Tangent tangent = Tangent::rotated;
    // Maximum number of linearisations; above 1 with line search, until newton_tolerance is met. 1: one, or
    // as many as contacts need.
    int newton_iterations = 1;
    // Newton stops at this residual impulse of every body, relative to its impulses of loads, elasticity and
    // contacts in the step, in the norm of the inverse masses, see ContactSolver::share_of_scales().
    double newton_tolerance = 1e-3;
    int max_substeps = 8;  // a power of two: a rejected step is cut into at most this many parts
};

struct WorldConfig {
    Eigen::Vector3d gravity{0, 0, -9.81};   // m/s2
    Keyed<Eigen::Vector3d> gravity_keys{};  // in place of it, m/s2; none: it stays as it is
    ContactConfig contact{};
    FailureLimits limits{};
    LinearSolveConfig linear{};
    std::shared_ptr<RestHierarchies>
        hierarchies{};  // may be shared by worlds of the same bodies; null: not shared
    StepConfig step{};
    std::optional<StaticConfig> statics{};  // none: steps in time
    // What positions of this world are counted from, metres, for those who tell them; steps do not depend on
    // it.
    Eigen::Vector3d origin = Eigen::Vector3d::Zero();
};

}  // namespace nbd
