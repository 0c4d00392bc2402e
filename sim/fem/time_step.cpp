#include "sim/fem/time_step.hpp"

namespace nbd {

// x1 = p x0 - q x(-1) + dt/c v1, likewise for v, with r = dt / dt_before, p = (1 + r)^2 / (1 + 2r) = 1 + q,
// q = r^2 / (1 + 2r), c = (1 + 2r) / (1 + r).
StepStart bdf2_start(const BodyState& before, const BodyState& now, double dt_before, double dt) {
    const double r = dt / dt_before, p = (1 + r) * (1 + r) / (1 + 2 * r), q = r * r / (1 + 2 * r);
    return {.state = {p * now.x - q * before.x, p * now.v - q * before.v},
            .step = {dt, (1 + 2 * r) / (1 + r)},
            .share_before = q};
}

}  // namespace nbd
