#pragma once

#include <Eigen/Core>

namespace nbd {

/// The Adam optimiser with its usual constants (0.9, 0.999, 1e-8) [KingmaBa15] and decoupled weight decay
/// [LoshchilovHutter19].
class Adam {
 public:
    /// weight_decay: every step scales the weights by 1 - learning rate * weight_decay; 0 gives plain Adam.
    Adam(int weights, double weight_decay)
        : m_(Eigen::VectorXf::Zero(weights)),
          v_(Eigen::VectorXf::Zero(weights)),
          weight_decay_(weight_decay) {}

    /// Moves `weights` one step against `gradient`.
    void step(const Eigen::VectorXf& gradient, double learning_rate, Eigen::VectorXf& weights) noexcept;

 private:
    Eigen::VectorXf m_, v_;  // running means of the gradient and its square
    double weight_decay_;
    double m_correction_ = 1, v_correction_ = 1;  // powers of the decay rates so far
};

}  // namespace nbd
