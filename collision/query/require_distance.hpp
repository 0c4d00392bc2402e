#pragma once

#include <cmath>
#include <stdexcept>

#include "collision/base/message.hpp"

namespace nbd {

/// Throws std::invalid_argument unless the distance of a query, metres, is finite and >= 0.
inline void require_distance(float distance) {
    if (!(distance >= 0 && std::isfinite(distance)))
        throw std::invalid_argument(message("distance is ", distance, " m, allowed: finite, 0 or more"));
}

}  // namespace nbd
