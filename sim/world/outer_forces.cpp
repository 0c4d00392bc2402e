// Outer forces and gravity over a step.
#include <algorithm>

#include "sim/world/world.hpp"

namespace nbd {

Eigen::Vector3d World::gravity_at(double time) const {
    return config_.gravity_keys.at(time, load_share(time) * config_.gravity);
}

/// Forces on the nodes of a body at the positions x, [N, 3] newtons. factor_of: of a load.
Nodes World::outer_forces(const Body& body, const Nodes& x,
                          const std::function<double(const Keyed<double>&)>& factor_of) const {
    Nodes forces = body.forces;
    for (const LoadForces& one : body.loads) one.add(x, factor_of(one.load().factor), forces);
    return forces;
}

/// At the end of the part, of the length dt.
Nodes World::end_forces(const Body& body, const Nodes& x, double dt) const {
    return outer_forces(
        body, x, [&](const Keyed<double>& factor) { return factor.at(time_ + dt, load_share(time_ + dt)); });
}

/// What acts with the weights of the rates before the part: a load that changes in time as its value now and
/// that at the start of the last part. A load that follows its body has the pose of now in both.
void World::begin_outer_forces(const TwoStepWeights& weights) {
    const double sum = weights.now + weights.before;
    const auto mean = [&](const auto& value_at) {
        const auto now = value_at(time_);
        if (!knows_last_) return now;
        return decltype(now)((weights.now * now + weights.before * value_at(time_ - dt_before_)) / sum);
    };
    // What stays as it is does so to the last bit.
    gravity_before_ =
        config_.gravity_keys.empty() ? config_.gravity : mean([&](double time) { return gravity_at(time); });
    for (Body& body : bodies_)
        body.outer_before = outer_forces(body, body.state.x, [&](const Keyed<double>& factor) {
            return factor.empty() ? 1 : mean([&](double time) { return factor.at(time, 1); });
        });
}

/// Gravity and forces at the end of the part. x: the pose at which it is linearised.
void World::set_end_forces(Body& body, const Nodes& x) {
    body.outer_end = end_forces(body, x, step_.dt);
    if (!body.gases.empty()) body.gas_end = gas_forces(body, x, time_ + step_.dt);
}

/// By how much the loads that follow a body do less work on the way between two iterates of a step than as
/// they were in the first, joules. Exact for pressures, whose forces are quadratic along a straight way.
double World::excess_work(const Body& body, const Nodes& from, const Nodes& to) const {
    if (std::ranges::none_of(body.loads, [](const LoadForces& one) { return one.load().follows(); }))
        return 0;
    const Nodes way = step_.dt * (to - from);
    const double end = time_ + step_.dt;
    const auto work_at = [&](double share) {
        const Nodes x = body.start.x + step_.dt * from + share * way;
        Nodes forces = Nodes::Zero(x.rows(), 3);
        for (const LoadForces& one : body.loads)
            if (one.load().follows()) one.add(x, one.load().factor.at(end, load_share(end)), forces);
        return forces.cwiseProduct(way).sum();
    };
    const double first = work_at(0);
    return first - (first + 4 * work_at(0.5) + work_at(1)) / 6;
}

}  // namespace nbd
