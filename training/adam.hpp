#pragma once

#include <Eigen/Core>

namespace nbd {

/// The Adam optimiser with its usual constants (0.9, 0.999, 1e-8) [KingmaBa15].
class Adam {
 public:
    explicit Adam(int weights) : m_(Eigen::VectorXf::Zero(weights)), v_(Eigen::VectorXf::Zero(weights)) {}

    /// Moves `weights` one step against `gradient`.
    void step(const Eigen::VectorXf& gradient, double learning_rate, Eigen::VectorXf& weights) noexcept;

 private:
    Eigen::VectorXf m_, v_;                       // running means of the gradient and its square
    double m_correction_ = 1, v_correction_ = 1;  // powers of the decay rates so far
};

}  // namespace nbd
