#pragma once

namespace nbd {

/// How a world seeks balance instead of taking steps in time. A step is an increment then, its length the
/// share of the load that it adds, and the time of the world the share that has come: gravity and loads
/// without keyframes of their own are multiplied by it, all keyframes go by it. Velocities are zero, and
/// nothing is damped.
struct StaticConfig {
    // Sum of the forces on a body's nodes that are out of balance at the end of an increment, relative to
    // that of its loads, of what supports it, or of its elasticity before the increment, whichever is
    // largest.
    double tolerance = 1e-6;
    int newton_iterations = 200;  // linearisations of an increment at most; in place of StepConfig's
};

/// Throws std::invalid_argument for a number out of range.
void check_static_config(const StaticConfig& config);

}  // namespace nbd
