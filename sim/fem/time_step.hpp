#pragma once

#include <optional>
#include <utility>

#include "meshing/surface/mesh.hpp"

namespace nbd {

/// Positions and velocities of a body's nodes, both [N, 3], m and m/s.
struct BodyState {
    Nodes x, v;
};

/// Where a step starts: x*, and v* = v + M^-1 impulses, kept apart as M is not diagonal in all bodies.
struct StepStart : BodyState {
    Nodes impulses{};  // [N, 3] N s, or empty for none
    // Of a static solve: the share of the mass that resists a change of v. Nothing is damped then. None: a
    // step in time.
    std::optional<double> static_mass{};

    StepStart() = default;
    explicit StepStart(BodyState state) : BodyState(std::move(state)) {}
};

/// Weights of rates at the end of a step, at its start and at the start of the one before: what a step adds
/// is dt times their sum, x1 = x0 + dt (end v1 + now v0 + before v(-1)), likewise for v with accelerations.
///
/// With end + now + before = 1 and end - before / r = 1/2, where r is the step over the last one, the rule is
/// of second order, and A-stable in equal steps [DahlquistLinigerNevanlinna83]. A vibration of N steps a
/// period loses energy in proportion to 2 end - 1: of 50 steps, 0.7 % in ten periods at `end` = 5/9. There,
/// what is far too fast for the steps falls by half from step to step.
struct TwoStepWeights {
    static constexpr double end = 5.0 / 9;
    double now, before;

    /// r: the length of the step over that of the last one.
    explicit TwoStepWeights(double r) noexcept : now(1 - end - r * (end - 0.5)), before(r * (end - 0.5)) {}
};

constexpr double most_growth = 2;  // of a step over the one before, for which the latter counts

/// One step in time from a start (x*, v*), with w as its unknown: the body ends at x1 = x* + dt w with the
/// velocities v1 = c w, where M (v1 - v*) = dt / c f(x1) + p. In a step of second order c = 1 /
/// TwoStepWeights::end, and the start holds what earlier rates add: those of inner forces, and of loads,
/// which are constant over the step. Contacts act with their whole impulse p in this step, and damping by
/// mass at its end alone. With c = 1, from the state before the step, it is backward Euler. Bodies that touch
/// may have different c.
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

}  // namespace nbd
