#include "training/adam.hpp"

#include <cmath>

namespace nbd {

void Adam::step(const Eigen::VectorXf& gradient, double learning_rate, Eigen::VectorXf& weights) noexcept {
    constexpr double beta1 = 0.9, beta2 = 0.999, epsilon = 1e-8;
    m_correction_ *= beta1;
    v_correction_ *= beta2;
    // rate * (m / c1) / (sqrt(v / c2) + eps), with the corrections drawn out of the loop.
    const double root = std::sqrt(1 - v_correction_);
    const auto rate = static_cast<float>(learning_rate * root / (1 - m_correction_));
    const auto offset = static_cast<float>(epsilon * root);

    const float* g = gradient.data();
    float *m = m_.data(), *v = v_.data(), *w = weights.data();
    for (Eigen::Index i = 0; i < weights.size(); ++i) {
        m[i] += static_cast<float>(1 - beta1) * (g[i] - m[i]);
        v[i] += static_cast<float>(1 - beta2) * (g[i] * g[i] - v[i]);
        w[i] -= rate * m[i] / (std::sqrt(v[i]) + offset);
    }
}

}  // namespace nbd
