// What the solution of a part of a step does: the motion and momentum of bodies, and the reactions.
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <optional>
#include <utility>

#include "meshing/parallel/parallel_for.hpp"
#include "sim/fem/momentum.hpp"
#include "sim/world/energy_budget.hpp"
#include "sim/world/step_loads.hpp"
#include "sim/world/time_rule.hpp"
#include "sim/world/world.hpp"

namespace nbd {
namespace {

/// Why the simulation has failed in this pose; empty: it has not.
std::string pose_failure(int body, const ElementReport& elements, int count, const FailureLimits& limits) {
    if (elements.non_finite > 0)
        return fmt::format("body {}: {} tetrahedra are not finite, the first is {}", body,
                           elements.non_finite, elements.first_non_finite);
    if (elements.inverted > limits.inverted_share * count)
        return fmt::format("body {}: {} of {} tetrahedra are inverted, the first is {}", body,
                           elements.inverted, count, elements.first_inverted);
    if (elements.stretch > limits.stretch)
        return fmt::format("body {}: tetrahedron {} is stretched {:.1f} times, more than {}", body,
                           elements.most_stretched, elements.stretch, limits.stretch);
    return {};
}

}  // namespace

/// Moves the bodies by the solution v of the step and, if the step was solved to its tolerance, gives those
/// that nothing holds the momentum that loads and contacts leave them and the solve has lost, as far as
/// contacts let them have it. Returns an empty text, or why the simulation has failed; the bodies then stay
/// where they are.
std::string World::move(const StepPart& part, const Eigen::VectorXd& v, bool is_solved, WorldReport& report) {
    const int bodies = state_.body_count();
    int inverted = 0;
    BodyPositions last{.x = state_.nodes_after(part.dt, v), .centres = {}};
    const std::vector<Nodes>& ends = last.x;
    last.centres = state_.centres_of(ends);
    const double dt = state_.dt;
    BodyPositions middles{.x = std::vector<Nodes>(bodies), .centres = std::vector<Eigen::Vector3d>(bodies)};
    std::vector<ElementReport> elements(bodies);
    const auto measure_end = [&](int b) {
        const SteppedBody& body = state_.at(b);
        middles.x[b] = middle(state_, body);
        middles.centres[b] = centre_of_mass(*body.elastic, middles.x[b]);
        elements[b] = body.elastic->measure(ends[b]);
    };
    parallel_for(bodies, measure_end, 1);
    for (int b = 0; b < bodies; ++b) {
        inverted += elements[b].inverted;
        std::string failure =
            pose_failure(b, elements[b], state_.at(b).elastic->element_count(), state_.config.limits);
        if (!failure.empty()) return failure;
    }
    report.inverted_elements = inverted;
    if (state_.config.statics) {
        for (int b = 0; b < bodies; ++b) state_.at(b).energy = elements[b].energy;
        come_to_rest(part, v, last);
        return {};
    }
    std::optional<EnergyBudget> budget;
    if (is_solved && EnergyBudget::limits(state_)) budget.emplace(state_, equations_, v);
    for (int b = 0; b < bodies; ++b) state_.at(b).energy = elements[b].energy;
    const Eigen::VectorXd impulses = equations_.solver.step_impulses(v);
    const Eigen::VectorXd all = equations_.bonds.empty() ? impulses : equations_.solver.impulses(v);
    BodyPositions first{.x = state_.nodes_now(), .centres = {}};
    first.centres = state_.centres_of(first.x);
    const ImpulsePlaces places{.starts = first, .middles = middles, .ends = last};
    const std::vector<Momentum> of_contacts = equations_.solver.momenta(v, places);
    std::vector<RigidVector> missing(bodies);  // impulses
    std::vector<std::optional<RigidMatrix>> inertia(bodies);
    const auto advance_body = [&](int b) {
        SteppedBody& body = state_.at(b);
        const std::size_t index = b;
        const Momentum loads = load_impulse(state_, b, ends[index]),
                       momentum = end_momentum(state_, joint_forces_, b, loads, of_contacts[index]);
        if (budget) budget->set_loads(b, loads);
        advance(state_, joint_forces_, equations_, b, state_.part_of(b, v), impulses, all);
        const Momentum solved = momentum_of(*body.elastic, body.state);
        // Damping by mass takes its share of an impulse, too.
        const double lasting = 1 + dt * body.elastic->material().rayleigh_mass;
        missing[index] << momentum.linear - solved.linear, momentum.angular - solved.angular;
        missing[index] *= lasting;
        if (!state_.is_held(body))
            inertia[index] = body.velocity_factor * lasting * rigid_inertia(*body.elastic, body.state.x);
    };
    parallel_for(bodies, advance_body, 1);
    std::vector<Eigen::Vector3d> more;  // impulses of the response
    if (is_solved) {
        // Where a step is long for contacts, momentum that is given without them would grow from step to
        // step.
        ContactSolver::RigidResponse response = equations_.solver.response(v, missing, inertia, places);
        std::vector<RigidVector> gains;  // of velocities
        for (int b = 0; b < bodies; ++b)
            gains.emplace_back(state_.at(b).velocity_factor * response.motions[b]);
        std::vector<double> shares;
        if (budget)
            shares =
                budget->shares(state_, gains, equations_.solver.pair_impulses(v, response.of_each, places));
        if (std::ranges::any_of(shares, [](double share) { return share < 1; })) {
            for (int b = 0; b < bodies; ++b) {
                missing[b].tail<3>() *= shares[b];
                if (shares[b] == 0 && state_.is_joined(b)) missing[b].setZero();  // noise
            }
            response = equations_.solver.response(v, missing, inertia, places);
        }
        for (int b = 0; b < state_.body_count(); ++b) {
            SteppedBody& body = state_.at(b);
            // What holds a body lets it get no momentum of these.
            if (const Eigen::Index held = body.holding.rows(); held > 0)
                body.holding.rowwise() -=
                    state_.part_of(b, response.impulses).colwise().sum() / static_cast<double>(held);
            add_motion(*body.elastic, body.velocity_factor * response.motions[b], body.state);
        }
        more = std::move(response.of_each);
    } else {
        // What did not balance the motion is no force of the body.
        for (SteppedBody& body : state_.bodies) body.inner_forces.resize(0, 3);
    }
    for (int b = 0; b < state_.body_count(); ++b) {
        add_holding_reactions(part, b, middles.x[b]);
        add_wind_reactions(state_, part.share, b, state_.part_of(b, v), middles.x[b], reactions_);
    }
    add_contact_reactions(part, equations_.solver.pair_impulses(v, more, places));
    joint_forces_.add_reactions(state_, equations_, part.share / part.dt, v, more, places, reactions_);
    joint_forces_.go_on();
    const Eigen::VectorXd of_contact = equations_.solver.contact_impulses(v, more);
    for (int b = 0; b < state_.body_count(); ++b)
        state_.at(b).contact_forces += part.share / dt * state_.part_of(b, of_contact);
    return {};
}

/// Gives bodies their velocities at the end of a part that comes to rest short of its solution, since
/// something is in the way: what touches nothing has those that were solved for, the rest those of the way
/// that it came. before: positions at the start of the part.
void World::end_short(const Eigen::VectorXd& solved, std::span<const Nodes> before) {
    const std::vector<char> pressed = equations_.solver.pressed_bodies();
    for (int b = 0; b < state_.body_count(); ++b) {
        SteppedBody& body = state_.at(b);
        const bool is_free = !pressed[b] && !state_.is_joined(b);
        const std::vector<int> held = body.before->held;
        const Nodes of_held = body.state.v(held, Eigen::all);
        body.state.v = is_free ? Nodes(body.velocity_factor * state_.part_of(b, solved))
                               : Nodes((body.state.x - before[b]) / state_.dt);
        body.state.v(held, Eigen::all) = of_held;
        body.before.reset();
    }
}

/// Ends an increment in the balance that v leads to, with the reactions there. ends: where v leads.
void World::come_to_rest(const StepPart& part, const Eigen::VectorXd& v, const BodyPositions& ends) {
    const StepPart whole{.dt = part.dt, .end = part.end, .share = 1};
    const Eigen::VectorXd impulses = equations_.solver.impulses(v),
                          of_contact = equations_.solver.contact_impulses(v, {});
    reactions_.clear();
    for (int b = 0; b < state_.body_count(); ++b) {
        SteppedBody& body = state_.at(b);
        const Nodes w = state_.part_of(b, v);
        body.start.v = w;  // no mass resists what is balanced
        body.before = PastStep{.v = {}, .inner_forces = {}, .held = state_.prescribed(body, part.dt).nodes};
        body.holding = holding_impulses(state_, equations_, b, w, impulses);
        add_holding_reactions(whole, b, ends.x[b]);
        add_wind_reactions(state_, whole.share, b, w, ends.x[b], reactions_);
        body.before.reset();
        body.contact_forces = state_.part_of(b, of_contact) / part.dt;
        body.state.x = ends.x[b];  // in place: arrays keep their place in memory
        body.state.v.setZero();
    }
    const ImpulsePlaces places{.starts = ends, .middles = ends, .ends = ends};
    add_contact_reactions(whole, equations_.solver.pair_impulses(v, {}, places));
    joint_forces_.add_reactions(state_, equations_, whole.share / whole.dt, v, {}, places, reactions_);
}

/// Adds what held the nodes of a body in a part. x: where it acts, [N, 3].
void World::add_holding_reactions(const StepPart& part, int index, const Nodes& x) {
    const SteppedBody& body = state_.at(index);
    std::vector<int> grip_of(x.rows(), -1);  // -1: driven
    for (std::size_t g = 0; g < body.grips.size(); ++g)
        if (body.grips[g].holds(state_.time))
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
    const double rate = part.share / part.dt;
    for (const PairImpulse& pair : pairs) {
        MeanPlace place;
        place.add(pair.place, rate);
        const bool by_obstacle = pair.other < 0;
        reactions_.add(pair.body, by_obstacle ? ReactionBy::obstacle : ReactionBy::body,
                       by_obstacle ? party_of_obstacle(pair.other) : pair.other, rate * pair.linear,
                       rate * pair.angular, place);
    }
}

}  // namespace nbd
