// What holds and presses bodies in a step.
#include "sim/world/reactions.hpp"

#include <Eigen/Geometry>

#include "sim/world/world.hpp"

namespace nbd {

void ReactionSums::add(int body, ReactionBy by, int number, const Eigen::Vector3d& force,
                       const Eigen::Vector3d& torque, const MeanPlace& place) {
    auto& [sum, places] = sums_[{body, static_cast<int>(by), number}];
    sum.body = body;
    sum.by = by;
    sum.number = number;
    sum.force += force;
    sum.torque += torque;
    places.add(place, 1);
}

std::vector<Reaction> ReactionSums::all() const {
    std::vector<Reaction> reactions;
    for (const auto& [key, sum] : sums_) {
        reactions.push_back(sum.reaction);
        reactions.back().point = sum.place.mean();
    }
    return reactions;
}

/// Impulses that the solver found to hold nodes at the velocities w, as StepSystem has them: [held, 3] N s.
/// impulses: of contacts on all nodes, stacked.
Nodes World::holding_impulses(int index, const Nodes& w, const Eigen::VectorXd& impulses) {
    const Body& body = at(index);
    const Eigen::VectorXd v = Eigen::Map<const Eigen::VectorXd>(w.data(), w.size());
    const std::vector<int> nodes = prescribed(body, step_.dt).nodes;
    Nodes holding;
    if (config_.step.newton_iterations > 1) {
        const Loads outer = end_loads(body);
        holding = StepPotential(*body.elastic, body.start, step_, outer, systems_[index].elements())
                      .gradient(w)(nodes, Eigen::all);
    } else {
        holding = systems_[index].holding_impulses(v);
    }
    return holding - body_part(index, impulses)(nodes, Eigen::all);
}

/// Adds what held the nodes of a body in a part. x: where it acts, [N, 3].
void World::add_holding_reactions(const StepPart& part, int index, const Nodes& x) {
    const Body& body = at(index);
    std::vector<int> grip_of(x.rows(), -1);  // -1: driven
    for (std::size_t g = 0; g < body.grips.size(); ++g)
        if (body.grips[g].holds(time_))
            for (const int node : body.grips[g].nodes) grip_of[node] = g;
    const double rate = part.share / part.dt;
    for (std::size_t k = 0; k < body.before->held.size(); ++k) {
        const int node = body.before->held[k], grip = grip_of[node];
        const Eigen::Vector3d force = rate * body.holding.row(k), arm = x.row(node);
        MeanPlace place;
        place.add(arm, force.norm());
        reactions_.add(index, grip < 0 ? ReactionBy::driven : ReactionBy::grip, std::max(grip, 0), force,
                       arm.cross(force), place);
    }
}

/// Adds what contacts did between bodies, and between bodies and obstacles, in a part.
void World::add_contact_reactions(const StepPart& part, std::span<const PairImpulse> pairs) {
    const double rate = part.share / (step_.velocity_factor * part.dt);
    for (const PairImpulse& pair : pairs) {
        MeanPlace place;
        place.add(pair.place, rate);
        const bool by_obstacle = pair.other < 0;
        reactions_.add(pair.body, by_obstacle ? ReactionBy::obstacle : ReactionBy::body,
                       by_obstacle ? party_of_obstacle(pair.other) : pair.other, rate * pair.linear,
                       rate * pair.angular, place);
    }
}

std::vector<Reaction> World::reactions() const {
    std::vector<Reaction> all = reactions_.all();
    for (Reaction& one : all) {
        one.torque += config_.origin.cross(one.force);
        if (one.by != ReactionBy::cavity) one.point += config_.origin;
    }
    for (const CavityState& cavity : cavities())
        for (Reaction& one : all)
            if (one.by == ReactionBy::cavity && one.body == cavity.body && one.number == cavity.number) {
                one.pressure = cavity.pressure;
                one.volume = cavity.volume;
            }
    return all;
}

}  // namespace nbd
