#include "sim/barrier/barrier_law.hpp"

#include <cmath>
#include <limits>

namespace nbd {

BarrierLaw::Terms BarrierLaw::at(double distance) const noexcept {
    if (!(distance < reach)) return {};
    constexpr double infinity = std::numeric_limits<double>::infinity();
    if (!(distance > floor)) return {infinity, -infinity, infinity};
    const double length = reach - floor, s = (distance - floor) / length, rest = 1 - s, log = std::log(s);
    return {.energy = -stiffness * length * length * rest * rest * log,
            .slope = stiffness * length * (2 * rest * log - rest * rest / s),
            .curvature = stiffness * (-2 * log + 4 * rest / s + rest * rest / (s * s))};
}

}  // namespace nbd
