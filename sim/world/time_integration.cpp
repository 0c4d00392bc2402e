// Which rule advances a body, where its step starts from, and where it ends.
#include "sim/world/world.hpp"

namespace nbd {

/// BDF2 for bodies without a contact in reach, neither in this step nor in the one before it: an impact would
/// be extrapolated.
void World::choose_steps(double dt) {
    std::vector<char> may_touch(bodies_.size(), 0);
    for (const Contact& contact : detection_.contacts())
        for (const SurfacePoint* point : {&contact.a, &contact.b})
            if (point->body >= 0) may_touch[static_cast<std::size_t>(point->body)] = 1;
    for (std::size_t b = 0; b < bodies_.size(); ++b) {
        Body& body = bodies_[b];
        body.start = {.state = {}, .step = dt};
        if (may_touch[b]) body.before.reset();
        if (body.before && dt <= max_bdf2_growth * dt_before_)
            body.start = bdf2_start(*body.before, body.state, dt_before_, dt);
        body.keeps_state = config_.step.integrator == TimeIntegrator::bdf2 && !may_touch[b];
    }
}

/// The unknown of the step if the body goes on as before.
Nodes World::first_iterate(const Body& body) const {
    if (&start_of(body) == &body.state) return body.state.v;
    const double growth = body.start.step.dt / dt_before_;
    return ((1 + growth) * body.state.v - growth * body.before->v) / body.start.step.velocity_factor;
}

/// v: the solution of the step.
void World::advance(Body& body, const Nodes& v) {
    const auto [dt, factor] = body.start.step;
    BodyState end{start_of(body).x + dt * v, factor * v};
    if (body.keeps_state)
        body.before = std::move(body.state);
    else
        body.before.reset();
    body.state = std::move(end);
}

}  // namespace nbd
