#include "sim/contact/barrier_law.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace nbd {

BarrierLaw::Terms BarrierLaw::at(double distance) const noexcept {
    if (!(distance < reach)) return {};
    if (distance < linear_below) {
        const Terms edge = BarrierLaw{reach, floor, stiffness, 0}.at(linear_below);
        const double beyond = distance - linear_below;
        return {.energy = edge.energy + beyond * (edge.slope + beyond * edge.curvature / 2),
                .slope = edge.slope + beyond * edge.curvature,
                .curvature = edge.curvature};
    }
    constexpr double infinity = std::numeric_limits<double>::infinity();
    if (!(distance > floor)) return {infinity, -infinity, infinity};
    const double length = reach - floor, s = (distance - floor) / length, rest = 1 - s, log = std::log(s);
    return {.energy = -stiffness * length * length * rest * rest * log,
            .slope = stiffness * length * (2 * rest * log - rest * rest / s),
            .curvature = stiffness * (-2 * log + 4 * rest / s + rest * rest / (s * s))};
}

}  // namespace nbd
