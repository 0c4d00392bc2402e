#include "sim/world/world.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

#include "collision/tree/auto_bounds.hpp"
#include "meshing/body/rigid_body.hpp"
#include "sim/world/gases.hpp"
#include "sim/world/step_loads.hpp"

namespace nbd {
namespace {

/// The linear solves must be more accurate than Newton's tolerance, or the iteration cannot reach it.
LinearSolveConfig linear_config(const WorldConfig& config) {
    LinearSolveConfig linear = config.linear;
    if (config.statics) linear.tolerance = std::min(linear.tolerance, 1e-4 * config.statics->tolerance);
    if (config.step.newton_iterations > 1)
        linear.tolerance = std::min(linear.tolerance, 0.1 * config.step.newton_tolerance);
    return linear;
}

/// The largest Young's modulus of the tetrahedra that a surface hangs on. A rigid body yields in contact as
/// it would be strained by an acceleration that it does not feel.
double surface_young(const ElasticBody& elastic, const Embedding& W) {
    if (elastic.is_rigid()) return rigid_strain * elastic.young(0);
    std::vector<char> carries(W.cols(), 0);
    for (Eigen::Index v = 0; v < W.rows(); ++v)
        for (Embedding::InnerIterator it(W, v); it; ++it)
            if (it.value() != 0) carries[it.col()] = 1;
    double largest = 0;
    for (int p = 0; p < elastic.point_count(); ++p)
        for (const int node : elastic.corner_tets().row(p))
            if (carries[node]) largest = std::max(largest, elastic.young(p / elastic.points_per_tet()));
    return largest;
}

}  // namespace

World::World(const WorldConfig& config)
    : state_{.config = config},
      equations_{.solver = ContactSolver(linear_config(config), config.hierarchies)} {
    check_contact_config(config.contact);
    if (config.statics) {
        check_static_config(*config.statics);
        state_.config.step.integrator = TimeIntegrator::backward_euler;
        state_.config.step.newton_iterations = config.statics->newton_iterations;
        state_.config.contact.tolerance =
            std::min(config.contact.tolerance, 1e-4 * config.statics->tolerance);
    }
    const auto is_finite = [](const Eigen::Vector3d& value) { return value.allFinite(); };
    if (!config.gravity_keys.is_sound(is_finite))
        throw std::invalid_argument("world: gravity needs finite values at times that increase");
    if (!config.gravity.allFinite()) throw std::invalid_argument("world: gravity is not finite");
    if (!(config.limits.inverted_share >= 0) || !(config.limits.stretch > 1))
        throw std::invalid_argument("world: failure limits need inverted_share >= 0 and stretch > 1");
    if (!(config.linear.tolerance > 0 && config.linear.tolerance < 1) || config.linear.max_iterations < 1)
        throw std::invalid_argument(
            "world: the linear solver needs 0 < tolerance < 1 and at least one iteration");
    const StepConfig& step = config.step;
    if (step.newton_iterations < 1 || !(step.newton_tolerance > 0) || step.max_substeps < 1 ||
        !std::has_single_bit(static_cast<unsigned>(step.max_substeps)))
        throw std::invalid_argument(
            "world: steps need newton_iterations >= 1, newton_tolerance > 0 and max_substeps a power of two");
}

/// The shape of an earlier body with the same rest shape and surface, or a new one. Takes the surface of
/// `body`.
std::shared_ptr<const ContactShape> World::contact_shape(WorldBody& body) const {
    for (const SteppedBody& other : state_.bodies)
        if (other.elastic == body.elastic && other.shape->is_of(body.W, body.F)) return other.shape;
    return std::make_shared<const ContactShape>(std::move(body.W), std::move(body.F), body.elastic->rest().X);
}

int World::add_body(WorldBody body) {
    if (!body.elastic) throw std::invalid_argument("world: a body has no elastic model");
    const ElasticBody& elastic = *body.elastic;
    const int nodes = elastic.node_count();
    if (body.state.x.size() == 0) body.state = {elastic.rest().X, Nodes::Zero(nodes, 3)};
    if (body.state.x.rows() != nodes || body.state.v.rows() != nodes || !body.state.x.allFinite() ||
        !body.state.v.allFinite())
        throw std::invalid_argument(
            fmt::format("world: a body's state needs {} finite positions and velocities", nodes));
    if (!body.friction.empty() && std::ssize(body.friction) != body.W.rows())
        throw std::invalid_argument(fmt::format("world: {} coefficients of friction for {} surface vertices",
                                                body.friction.size(), body.W.rows()));
    for (const double friction : body.friction)
        if (!std::isfinite(friction))
            throw std::invalid_argument(fmt::format("world: friction is {}, allowed: finite", friction));
    std::vector<Nodes> grip_start;
    for (const Grip& grip : body.grips) {
        check_grip(grip, nodes);
        grip_start.push_back(grip.take <= state_.time ? Nodes(body.state.x(grip.nodes, Eigen::all))
                                                      : Nodes(0, 3));
    }
    if (const auto odds = grips_at_odds(body.grips))
        throw std::invalid_argument(fmt::format("world: grips {} and {} of a body both hold node {} at {} s",
                                                odds->first, odds->second, odds->node, odds->from));
    std::unique_ptr<PosedTree> tree;
    if (body.tree) {
        if (body.tree->vertex_count != body.W.rows() || body.tree->faces != body.F)
            throw std::invalid_argument(
                "world: a collision tree belongs to another surface than that of its body");
        const BoundKind bounds = exact_for_auto(*body.tree, body.bounds);
        tree = std::make_unique<PosedTree>(body.tree, bounds, body.margin);
        if (tree->takes_nodes() && !body.tree->affine->hangs_by(body.W.cast<float>()))
            throw std::invalid_argument(
                "world: the affine bounds of a collision tree have other weights than the body");
    }
    const double contact_young = surface_young(elastic, body.W);
    PairBounds bounds{body.tree, body.bounds, body.margin};
    std::shared_ptr<const ContactShape> shape = contact_shape(body);
    if (state_.config.statics) body.state.v.setZero();
    const int index = state_.body_count();
    Nodes added_at = body.grips.empty() ? Nodes{} : body.state.x;
    SteppedBody made{.elastic = std::move(body.elastic),
                     .shape = std::move(shape),
                     .bounds = std::move(bounds),
                     .tree = std::move(tree),
                     .state = std::move(body.state),
                     .contact_young = contact_young,
                     .forces = Nodes::Zero(nodes, 3),
                     .contact_forces = Nodes::Zero(nodes, 3),
                     .loads = {},
                     .outer_before = {},
                     .outer_end = {},
                     .added = state_.time,
                     .grips = std::move(body.grips),
                     .grip_start = std::move(grip_start),
                     .added_at = std::move(added_at),
                     .friction = std::move(body.friction),
                     .name = body.name.empty() ? fmt::format("body {}", index) : std::move(body.name)};
    for (int k = 0; k < std::ssize(body.loads); ++k) body.loads[k].number = k;
    take_winds(made, body.loads);
    take_gases(made, body.loads);
    for (BodyLoad& load : body.loads) made.loads.emplace_back(std::move(load), elastic, *made.shape);
    equations_.systems.emplace_back(elastic);
    state_.bodies.push_back(std::move(made));
    state_.first_unknown.push_back(state_.first_unknown.back() + 3 * nodes);
    forget_parts();
    return index;
}

void World::drive(int body, std::vector<int> nodes, Nodes targets) {
    SteppedBody& driven = state_.at(body);
    const int count = driven.elastic->node_count();
    if (targets.rows() != std::ssize(nodes))
        throw std::invalid_argument(
            fmt::format("world: {} driven nodes need as many targets, not {}", nodes.size(), targets.rows()));
    if (!targets.allFinite()) throw std::invalid_argument("world: a target of driven nodes is not finite");
    std::vector<char> is_taken(count, 0);
    for (const Grip& grip : driven.grips)
        for (const int node : grip.nodes) is_taken[node] |= static_cast<char>(grip.holds(state_.time));
    for (const int node : nodes) {
        if (node < 0 || node >= count)
            throw std::invalid_argument(
                fmt::format("world: driven node {} is not in 0..{}", node, count - 1));
        if (std::exchange(is_taken[node], 1) != 0)
            throw std::invalid_argument(
                fmt::format("world: driven node {} is named twice, or held by a grip", node));
    }
    driven.driven = {.nodes = std::move(nodes), .from = {}, .to = std::move(targets), .start = 0, .end = 0};
}

void World::add_obstacle(Obstacle obstacle) {
    check_obstacle(obstacle);
    state_.obstacles.push_back(std::move(obstacle));
    forget_parts();
}

void World::set_pair(int a, int b, const PairRule& rule) {
    for (const int party : {a, b})
        if (party >= state_.body_count() || party < party_of_obstacle(std::ssize(state_.obstacles) - 1))
            throw std::invalid_argument(
                fmt::format("world: a pair names {} {}, but there are {}", party < 0 ? "obstacle" : "body",
                            party < 0 ? party_of_obstacle(party) : party,
                            party < 0 ? state_.obstacles.size() : state_.bodies.size()));
    state_.pairs.set(a, b, rule);
    forget_parts();
}

int World::add_joint(Joint joint) {
    check_joint(joint, state_.body_count());
    holds_.resize(state_.bodies.size());
    std::vector<const ElasticBody*> elastic;
    std::vector<double> sizes;
    for (std::size_t b = 0; b < state_.bodies.size(); ++b) {
        elastic.push_back(state_.bodies[b].elastic.get());
        sizes.push_back(state_.bodies[b].shape->rest_diagonal);
        const int body = static_cast<int>(b);
        if (body != joint.a && body != joint.b) continue;
        for (std::size_t c = 0; c < b && !holds_[b]; ++c)
            if (state_.bodies[c].elastic == state_.bodies[b].elastic) holds_[b] = holds_[c];
        if (!holds_[b]) holds_[b] = std::make_shared<const NodeHold>(node_hold(*state_.bodies[b].elastic));
    }
    const int index = joint_count();
    JointBonds bonds(std::move(joint), index, elastic, state_.nodes_now(), holds_, sizes);
    const Joint& made = bonds.joint();
    const bool meet = made.b < 0 || made.bodies_meet || std::holds_alternative<CordJoint>(made.kind);
    if (!meet) {
        PairRule rule = state_.pairs.of(made.a, made.b);
        rule.meets = false;
        set_pair(made.a, made.b, rule);
    }
    state_.forget_steps(made);
    state_.joints.push_back(std::move(bonds));
    state_.broken.push_back(0);
    joint_forces_.add_joint();
    return index;
}

void World::add_tendon(Tendon tendon) {
    if (state_.config.statics) throw std::invalid_argument("tendon: statics know no winch");
    if (tendon.parts.empty()) throw std::invalid_argument("tendon: it has no parts");
    for (const int part : tendon.parts) {
        if (part < 0 || part >= joint_count())
            throw std::invalid_argument(
                fmt::format("tendon: joint {} is not one of {}", part, joint_count()));
        const auto* cord = std::get_if<CordJoint>(&joint(part).kind);
        if (!cord || cord->tension.empty() || state_.tendon_of(part) >= 0 ||
            std::ranges::count(tendon.parts, part) > 1)
            throw std::invalid_argument(fmt::format(
                "tendon: joint \"{}\" is no cord with a given tension of its own", joint(part).name));
    }
    const auto is_length = [](double length) { return std::isfinite(length) && length > 0; };
    if (tendon.winch.empty() || !tendon.winch.is_sound(is_length))
        throw std::invalid_argument("tendon: its winch needs lengths > 0 at times that increase");
    if (!(tendon.stiffness >= 0) || !std::isfinite(tendon.stiffness) || !(tendon.fixed >= 0))
        throw std::invalid_argument("tendon: it needs a stiffness >= 0");
    state_.tendons.push_back(std::move(tendon));
}

void World::move_obstacle(int obstacle, Keyframe place) {
    if (targets_.move_obstacle(state_, obstacle, std::move(place))) forget_parts();
}

void World::move_grip(int body, int grip, Keyframe place) {
    if (targets_.move_grip(state_, body, grip, std::move(place))) forget_parts();
}

void World::set_joint(int joint, double value) { targets_.set_joint(state_, joint, value); }

void World::set_load(int body, int load, double factor) { targets_.set_load(state_, body, load, factor); }

void World::set_wind(int body, int load, const Eigen::Vector3d& velocity) {
    targets_.set_wind(state_, body, load, velocity);
}

std::vector<CavityState> World::cavities() const { return cavity_states(state_); }

/// Discards what was made of the bodies and obstacles so far.
void World::forget_parts() {
    barrier_.reset();
    start_is_checked_ = false;
}

std::vector<FacePair> World::within(int a, int b, double distance) {
    for (const int index : {a, b}) {
        SteppedBody& body = state_.at(index);
        if (!body.tree)
            throw std::invalid_argument(fmt::format("world: body {} has no collision tree", index));
        begin_pose(body, *body.tree);
    }
    const auto pairs = query_.within(*state_.at(a).tree, *state_.at(b).tree, static_cast<float>(distance));
    return {pairs.begin(), pairs.end()};
}

void World::begin_pose(SteppedBody& body, PosedTree& tree) {
    if (tree.takes_nodes()) {
        body.posed = body.state.x.cast<float>();
        tree.begin_pose_of_nodes(body.posed);
    } else {
        body.posed = embedded(body.shape->W, body.state.x).cast<float>();
        tree.begin_pose(body.posed);
    }
}

bool World::has_vertex(int body, int vertex) const {
    return body >= 0 && body < state_.body_count() && vertex >= 0 &&
           vertex < state_.at(body).shape->vertex_count();
}

std::vector<Reaction> World::reactions() const {
    std::vector<Reaction> all = reactions_.all();
    for (Reaction& one : all) {
        one.torque += state_.config.origin.cross(one.force);
        if (one.by != ReactionBy::cavity) one.point += state_.config.origin;
    }
    for (const CavityState& cavity : cavities())
        for (Reaction& one : all)
            if (one.by == ReactionBy::cavity && one.body == cavity.body && one.number == cavity.number) {
                one.pressure = cavity.pressure;
                one.volume = cavity.volume;
            }
    return all;
}

WorldSnapshot World::snapshot() const {
    WorldSnapshot snapshot;
    snapshot.time = state_.time;
    snapshot.dt_before = state_.dt_before;
    for (const SteppedBody& body : state_.bodies) {
        snapshot.bodies.push_back(body.state);
        snapshot.inner_forces.push_back(body.inner_forces);
        snapshot.before.push_back(body.before.value_or(PastStep{}));
    }
    snapshot.stretches = friction_memory_.stretches();
    bool is_any_taken = false;
    for (const SteppedBody& body : state_.bodies) {
        std::vector<Nodes>& taken = snapshot.taken_at.emplace_back();
        for (std::size_t g = 0; g < body.grips.size(); ++g) {
            taken.push_back(body.takes_later(g) ? body.grip_start[g] : Nodes(0, 3));
            is_any_taken = is_any_taken || taken.back().rows() > 0;
        }
    }
    if (!is_any_taken) snapshot.taken_at.clear();
    snapshot.broken = state_.broken;
    snapshot.springs_before = joint_forces_.before();
    return snapshot;
}

void World::restore(const WorldSnapshot& snapshot) {
    if (std::ssize(snapshot.bodies) != state_.body_count() ||
        (!snapshot.inner_forces.empty() && snapshot.inner_forces.size() != snapshot.bodies.size()) ||
        (!snapshot.before.empty() && snapshot.before.size() != snapshot.bodies.size()) ||
        (!snapshot.taken_at.empty() && snapshot.taken_at.size() != snapshot.bodies.size()))
        throw std::invalid_argument(fmt::format("world: a snapshot of {} bodies for {}",
                                                snapshot.bodies.size(), state_.body_count()));
    for (int b = 0; b < state_.body_count(); ++b) {
        const auto fits = [&](const Nodes& rows) {
            return rows.rows() == elastic(b).node_count() && rows.allFinite();
        };
        const BodyState& state = snapshot.bodies[b];
        const PastStep before = snapshot.before.empty() ? PastStep{} : snapshot.before[b];
        const Nodes forces = snapshot.inner_forces.empty() ? Nodes{} : snapshot.inner_forces[b];
        const bool is_known = before.v.size() > 0 || before.inner_forces.size() > 0;
        if (!fits(state.x) || !fits(state.v) || (forces.size() > 0 && !fits(forces)) ||
            (is_known && !(fits(before.v) && fits(before.inner_forces) && snapshot.dt_before >= 0)) ||
            (!snapshot.taken_at.empty() && !state_.at(b).could_take(snapshot.taken_at[b])))
            throw std::invalid_argument(fmt::format("world: the snapshot of body {} does not fit it", b));
    }
    const FrictionStretches& stretches = snapshot.stretches;
    for (std::size_t i = 0; i < std::max(stretches.contacts.size(), stretches.ways.size()); ++i) {
        const bool is_there = i < stretches.contacts.size() && i < stretches.ways.size();
        const std::array<int, 6> contact = is_there ? stretches.contacts[i] : std::array<int, 6>{};
        const auto fits = [&](int body, int vertex) { return vertex == -1 || has_vertex(body, vertex); };
        const bool is_obstacle = contact[3] < 0 && -1 - contact[3] < std::ssize(state_.obstacles);
        if (!is_there || !has_vertex(contact[0], contact[1]) || !fits(contact[0], contact[2]) ||
            !(is_obstacle ||
              (has_vertex(contact[3], 0) && fits(contact[3], contact[4]) && fits(contact[3], contact[5]))) ||
            !stretches.ways[i].allFinite())
            throw std::invalid_argument(
                fmt::format("world: entry {} of the snapshot's friction does not fit the bodies", i));
    }
    for (const std::size_t count : {snapshot.broken.size(), snapshot.springs_before.size()})
        if (count != 0 && count != state_.joints.size())
            throw std::invalid_argument(
                fmt::format("world: a snapshot of {} joints for {}", count, state_.joints.size()));
    for (const JointLoad& load : snapshot.springs_before)
        for (const Momentum* side : {&load.on_a, &load.on_b})
            if (!side->linear.allFinite() || !side->angular.allFinite())
                throw std::invalid_argument("world: the snapshot's forces of springs are not finite");
    if (targets_.forget(state_)) forget_parts();
    reset(snapshot);
    for (SteppedBody& body : state_.bodies) body.energy = body.elastic->measure(body.state.x).energy;
    start_is_checked_ = false;
    reactions_.clear();
    for (SteppedBody& body : state_.bodies) {
        body.contact_forces.setZero();
        body.driven.start = body.driven.end = state_.time;  // moves from the restored places to its targets
    }
}

void World::reset(const WorldSnapshot& snapshot) {
    for (int b = 0; b < state_.body_count(); ++b) {
        state_.at(b).state = snapshot.bodies[b];
        state_.at(b).inner_forces = snapshot.inner_forces.empty() ? Nodes{} : snapshot.inner_forces[b];
        state_.at(b).before.reset();
        if (!snapshot.before.empty() && snapshot.before[b].v.size() > 0)
            state_.at(b).before = snapshot.before[b];
        for (std::size_t g = 0; g < state_.at(b).grips.size(); ++g)
            if (state_.at(b).takes_later(g))
                state_.at(b).grip_start[g] =
                    snapshot.taken_at.empty() ? Nodes(0, 3) : snapshot.taken_at[b][g];
    }
    state_.time = snapshot.time;
    state_.dt_before = snapshot.dt_before;
    friction_memory_.restore(snapshot.stretches);
    state_.broken = snapshot.broken;
    state_.broken.resize(state_.joints.size(), 0);
    std::vector<JointLoad> springs = snapshot.springs_before;
    springs.resize(state_.joints.size());
    joint_forces_.set_before(std::move(springs));
}

}  // namespace nbd
