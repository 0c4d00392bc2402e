#pragma once

#include "meshing/surface/mesh.hpp"

namespace nbd {

/// Positions and velocities of a body's nodes, both [N, 3], m and m/s.
struct BodyState {
    Nodes x, v;
};

/// One step in time from a start (x*, v*), with w as its unknown: the body ends at x* + dt w with velocities
/// c w, where c is velocity_factor. Both rules solve M (c w - v*) = (dt / c) f(x* + dt w):
///
///   backward Euler   (x*, v*) is the state before the step, c = 1; w is the velocity at the end
///   BDF2             (x*, v*) follows from the last two states, see bdf2_start()
struct TimeStep {
    double dt = 0;               // seconds, > 0
    double velocity_factor = 1;  // c

    /// A step of backward Euler.
    TimeStep(double length) noexcept : dt(length) {}
    TimeStep(double length, double factor) noexcept : dt(length), velocity_factor(factor) {}

    /// Where strain rates are measured, as a share of the way from x* to the end: where the velocities of a
    /// body that only rotates strain nothing.
    double strain_rate_at() const noexcept { return velocity_factor > 1 ? 1 : 0.5; }
};

/// The start of a step and the step itself.
struct StepStart {
    BodyState state;
    TimeStep step;
    double share_before = 0;  // q: (x*, v*) is (1 + q) times the state before the step minus q times the last
};

/// The second order backward differentiation formula for steps of two lengths. before: the state dt_before >
/// 0 earlier than `now`. Hardly damps vibrations of 20 or more steps a period. Steps must not grow by more
/// than a factor of 1 + sqrt(2) [HairerNorsettWanner93, III.5].
inline StepStart bdf2_start(const BodyState& before, const BodyState& now, double dt_before, double dt) {
    // x1 = p x0 - q x(-1) + dt/c v1, likewise for v, with r = dt / dt_before, p = (1 + r)^2 / (1 + 2r) = 1 +
    // q, q = r^2 / (1 + 2r), c = (1 + 2r) / (1 + r).
    const double r = dt / dt_before, p = (1 + r) * (1 + r) / (1 + 2 * r), q = r * r / (1 + 2 * r);
    return {.state = {p * now.x - q * before.x, p * now.v - q * before.v},
            .step = {dt, (1 + 2 * r) / (1 + r)},
            .share_before = q};
}

constexpr double max_bdf2_growth = 2;  // of the step length, from one step to the next

}  // namespace nbd
