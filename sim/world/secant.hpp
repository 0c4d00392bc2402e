#pragma once

#include <Eigen/Core>
#include <utility>

namespace nbd {

/// Solves for unknowns that stand beside a system: each try of theirs is a solve of it, which tells by how
/// much they are off, and how that has changed leads to the next try.
class Secant {
 public:
    /// response: by how much more they are off where they are changed, as far as it is known at first.
    explicit Secant(Eigen::MatrixXd response) : response_(std::move(response)) {}

    /// The way to the next try from one that was off by this.
    Eigen::VectorXd way_from(const Eigen::VectorXd& off);
    /// The way that was gone instead.
    void went(const Eigen::VectorXd& way) { way_ = way; }

 private:
    Eigen::MatrixXd response_;
    Eigen::VectorXd off_, way_;
    int tries_ = 0;
};

}  // namespace nbd
