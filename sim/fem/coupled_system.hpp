#pragma once

#include <Eigen/Core>
#include <span>

#include "sim/fem/step_system.hpp"

namespace nbd {

/// Weight of a node in the relative velocity of two points.
struct CouplingTerm {
    int body = 0, node = 0;
    int unknown = 0;  // row of the node's x velocity in the stacked vector
    double weight = 0;
    bool held = false;  // the node's velocity is prescribed, so it has no equation
};

/// The term J^T A J, where J v is the sum of weight times velocity over a range of terms. A is symmetric
/// positive semi-definite.
struct Coupling {
    int begin = 0, end = 0;
    Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
};

/// The linear system of the stacked velocities of all bodies: the matrix of each body and the couplings. A
/// view; the data must outlive it.
struct CoupledSystem {
    std::span<const StepSystem> systems;
    std::span<const int> first_unknown;  // [bodies + 1] first unknown of each body, then the total number
    std::span<const CouplingTerm> terms;
    std::span<const Coupling> couplings;

    int size() const noexcept { return first_unknown.back(); }
    int node_count() const noexcept { return size() / 3; }
    std::span<const CouplingTerm> terms_of(const Coupling& coupling) const noexcept {
        return terms.subspan(coupling.begin, coupling.end - coupling.begin);
    }

    /// out = (matrices + couplings) v. out must not overlap v.
    void multiply(const Eigen::VectorXd& v, Eigen::VectorXd& out) const;

    /// out += couplings times v.
    void add_couplings(const Eigen::VectorXd& v, Eigen::VectorXd& out) const;
};

}  // namespace nbd
