#pragma once

#include <compare>

#include "collision/continuous/feature_pair.hpp"

namespace nbd {

/// Features are near within this multiple of the distance at which they begin to press: the next iterate of a
/// step may have them press.
inline constexpr double near_share = 2;

/// A pair of features that may come near during a motion, and the distance at which it begins to press,
/// metres.
struct NearFeatures {
    FeaturePair pair;
    double reach = 0;
    auto operator<=>(const NearFeatures&) const = default;
};

}  // namespace nbd
