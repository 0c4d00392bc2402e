#pragma once

#include <cmath>

namespace nbd {

/// How far the vertices of a patch reach beyond the box of a few of them, its samples, in units of the
/// samples' spread: the root mean square of their distances from their mean, which grows as the patch
/// stretches.
struct BoxFit {
    float growth = 0;             // each side of the box moves outward by growth * spread
    float mean = 0;               // mean of spread^2 in training, m^2
    float inverse_deviation = 0;  // 1 / standard deviation of spread^2 in training, m^-2

    /// Distance of spread^2, m^2, from its mean in training, in standard deviations.
    float ood_score(float squared_spread) const noexcept {
        return std::abs(squared_spread - mean) * inverse_deviation;
    }
};

}  // namespace nbd
