#pragma once

#include <limits>

#include "collision/geometry/box.hpp"

namespace nbd {

/// Threshold for a squared length computed in float32 from coordinate differences: above it, the length
/// certainly exceeds `limit`. The differences, the three squares and their sum are off by at most 3 ulp; the
/// rest allows for `limit` being a rounded sum.
inline float certain_square(float limit) noexcept {
    constexpr float slack = 1 + 16 * std::numeric_limits<float>::epsilon();
    return limit * limit * slack + std::numeric_limits<float>::min();
}

/// Whether a length, given by its square, certainly exceeds `limit`; false for NaN.
inline bool certainly_longer(float squared_length, float limit) noexcept {
    return squared_length > certain_square(limit);
}

/// Whether no point of s is within `distance` of a point of t. Never true in error; may be false if they are
/// apart by only a few ulp.
inline bool apart(const Sphere& s, const Sphere& t, float distance) noexcept {
    return certainly_longer((s.c - t.c).squaredNorm(), s.r + t.r + distance);
}

inline bool apart(const Box& s, const Box& t, float distance) noexcept {
    const Eigen::Array4f gap = (s.lo - t.hi).max(t.lo - s.hi).max(0.f);
    return certainly_longer(gap.square().sum(), distance);
}

}  // namespace nbd
