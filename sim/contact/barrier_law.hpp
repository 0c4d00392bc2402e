#pragma once

namespace nbd {

/// A potential that is zero from the distance `reach` on and grows without bound towards `floor`:
///
///   W(d) = -stiffness L^2 (1 - s)^2 ln s,   s = (d - floor) / L,   L = reach - floor
///
/// Twice continuously differentiable and convex. Below the distance `linear_below` the force goes on along
/// its tangent, so that an iteration may come there, and is finite. Source: [Li20], with a distance in place
/// of its square.
struct BarrierLaw {
    double reach = 0, floor = 0;  // metres, reach > floor >= 0
    double stiffness = 0;         // N/m
    double linear_below = 0;      // metres, > floor; or 0: nowhere

    /// The potential and its derivatives by the distance: joules, newtons, N/m.
    struct Terms {
        double energy = 0, slope = 0, curvature = 0;
    };
    /// Infinite at distances of `floor` and below, where these are not below `linear_below`.
    Terms at(double distance) const noexcept;
};

}  // namespace nbd
