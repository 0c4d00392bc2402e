#include "training/networks/adam.hpp"

#include <cmath>

namespace nbd {

void Adam::step(const Eigen::VectorXf& gradient, double learning_rate, Eigen::VectorXf& weights) noexcept {
    constexpr double beta1 = 0.9, beta2 = 0.999, epsilon = 1e-8;
    m_correction_ *= beta1;
    v_correction_ *= beta2;
    // Computes rate * (m / c1) / sqrt(v / c2 + eps^2) with the corrections moved out of the loop. Putting
    // epsilon under the root matters only where v is almost 0.
    const auto rate = static_cast<float>(learning_rate * std::sqrt(1 - v_correction_) / (1 - m_correction_));
    const auto offset = static_cast<float>(epsilon * epsilon * (1 - v_correction_));
    const auto kept = static_cast<float>(1 - learning_rate * weight_decay_);

    const float* g = gradient.data();
    float *m = m_.data(), *v = v_.data(), *w = weights.data();
    for (Eigen::Index i = 0; i < weights.size(); ++i) {
        m[i] += static_cast<float>(1 - beta1) * (g[i] - m[i]);
        v[i] += static_cast<float>(1 - beta2) * (g[i] * g[i] - v[i]);
        w[i] = kept * w[i] - rate * m[i] * (1 / std::sqrt(v[i] + offset));
    }
}

}  // namespace nbd
