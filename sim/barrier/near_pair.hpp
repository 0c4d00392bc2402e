#pragma once

#include <compare>

#include "collision/continuous/feature_pair.hpp"

namespace nbd {

/// A pair of features that may come near during a motion, and the distance at which it begins to press,
/// metres.
struct NearFeatures {
    FeaturePair pair;
    double reach = 0;
    auto operator<=>(const NearFeatures&) const = default;
};

}  // namespace nbd
