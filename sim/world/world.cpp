#include "sim/world/world.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

#include "collision/tree/auto_bounds.hpp"

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
    : config_(config), solver_(linear_config(config), config.hierarchies) {
    check_contact_config(config.contact);
    if (config.statics) {
        check_static_config(*config.statics);
        config_.step.integrator = TimeIntegrator::backward_euler;
        config_.step.newton_iterations = config.statics->newton_iterations;
        config_.contact.tolerance = std::min(config.contact.tolerance, 1e-4 * config.statics->tolerance);
    }
    const auto& [times, values] = config.gravity_keys;
    bool is_in_order = times.size() == values.size();
    for (std::size_t k = 0; is_in_order && k < times.size(); ++k)
        is_in_order = std::isfinite(times[k]) && values[k].allFinite() && (k == 0 || times[k] > times[k - 1]);
    if (!is_in_order)
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
    for (const Body& other : bodies_)
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
        grip_start.push_back(grip.take <= time_ ? Nodes(body.state.x(grip.nodes, Eigen::all)) : Nodes(0, 3));
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
    if (config_.statics) body.state.v.setZero();
    const int index = body_count();
    Nodes added_at = body.grips.empty() ? Nodes{} : body.state.x;
    Body made{.elastic = std::move(body.elastic),
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
              .added = time_,
              .grips = std::move(body.grips),
              .grip_start = std::move(grip_start),
              .added_at = std::move(added_at),
              .friction = std::move(body.friction),
              .name = body.name.empty() ? fmt::format("body {}", index) : std::move(body.name)};
    for (int k = 0; k < std::ssize(body.loads); ++k) body.loads[k].number = k;
    add_winds(made, body.loads);
    add_cavities(made, body.loads);
    for (BodyLoad& load : body.loads) made.loads.emplace_back(std::move(load), elastic, *made.shape);
    systems_.emplace_back(elastic);
    bodies_.push_back(std::move(made));
    first_unknown_.push_back(first_unknown_.back() + 3 * nodes);
    forget_parts();
    return index;
}

void World::drive(int body, std::vector<int> nodes, Nodes targets) {
    Body& driven = at(body);
    const int count = driven.elastic->node_count();
    if (targets.rows() != std::ssize(nodes))
        throw std::invalid_argument(
            fmt::format("world: {} driven nodes need as many targets, not {}", nodes.size(), targets.rows()));
    if (!targets.allFinite()) throw std::invalid_argument("world: a target of driven nodes is not finite");
    std::vector<char> is_taken(count, 0);
    for (const Grip& grip : driven.grips)
        for (const int node : grip.nodes) is_taken[node] |= static_cast<char>(grip.holds(time_));
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
    obstacles_.push_back(std::move(obstacle));
    forget_parts();
}

void World::set_pair(int a, int b, const PairRule& rule) {
    for (const int party : {a, b})
        if (party >= body_count() || party < party_of_obstacle(std::ssize(obstacles_) - 1))
            throw std::invalid_argument(fmt::format("world: a pair names {} {}, but there are {}",
                                                    party < 0 ? "obstacle" : "body",
                                                    party < 0 ? party_of_obstacle(party) : party,
                                                    party < 0 ? obstacles_.size() : bodies_.size()));
    pairs_.set(a, b, rule);
    forget_parts();
}

double World::thickness() const noexcept {
    return config_.contact.thickness > 0 ? config_.contact.thickness : 0.001 * smallest_diagonal();
}

double World::smallest_diagonal() const noexcept {
    double smallest = std::numeric_limits<double>::infinity();
    for (const Body& body : bodies_) smallest = std::min(smallest, body.shape->rest_diagonal);
    return smallest;
}

/// Discards what was made of the bodies and obstacles so far.
void World::forget_parts() {
    barrier_.reset();
    start_is_checked_ = false;
}

std::vector<FacePair> World::within(int a, int b, double distance) {
    for (const int index : {a, b}) {
        Body& body = at(index);
        if (!body.tree)
            throw std::invalid_argument(fmt::format("world: body {} has no collision tree", index));
        begin_pose(body, *body.tree);
    }
    const auto pairs = query_.within(*at(a).tree, *at(b).tree, static_cast<float>(distance));
    return {pairs.begin(), pairs.end()};
}

void World::begin_pose(Body& body, PosedTree& tree) {
    if (tree.takes_nodes()) {
        body.posed = body.state.x.cast<float>();
        tree.begin_pose_of_nodes(body.posed);
    } else {
        body.posed = embedded(body.shape->W, body.state.x).cast<float>();
        tree.begin_pose(body.posed);
    }
}

Nodes World::body_part(int body, const Eigen::VectorXd& stacked) const {
    return Eigen::Map<const Nodes>(stacked.data() + first_unknown_[body], at(body).state.v.rows(), 3);
}

bool World::has_vertex(int body, int vertex) const {
    return body >= 0 && body < body_count() && vertex >= 0 && vertex < at(body).shape->vertex_count();
}

WorldSnapshot World::snapshot() const {
    WorldSnapshot snapshot;
    snapshot.time = time_;
    snapshot.dt_before = dt_before_;
    for (const Body& body : bodies_) {
        snapshot.bodies.push_back(body.state);
        snapshot.inner_forces.push_back(body.inner_forces);
        snapshot.before.push_back(body.before.value_or(PastStep{}));
    }
    snapshot.stretches = friction_memory_.stretches();
    bool is_any_taken = false;
    for (const Body& body : bodies_) {
        std::vector<Nodes>& taken = snapshot.taken_at.emplace_back();
        for (std::size_t g = 0; g < body.grips.size(); ++g) {
            taken.push_back(body.takes_later(g) ? body.grip_start[g] : Nodes(0, 3));
            is_any_taken = is_any_taken || taken.back().rows() > 0;
        }
    }
    if (!is_any_taken) snapshot.taken_at.clear();
    snapshot.broken = broken_;
    snapshot.springs_before = springs_before_;
    return snapshot;
}

void World::restore(const WorldSnapshot& snapshot) {
    if (std::ssize(snapshot.bodies) != body_count() ||
        (!snapshot.inner_forces.empty() && snapshot.inner_forces.size() != snapshot.bodies.size()) ||
        (!snapshot.before.empty() && snapshot.before.size() != snapshot.bodies.size()) ||
        (!snapshot.taken_at.empty() && snapshot.taken_at.size() != snapshot.bodies.size()))
        throw std::invalid_argument(
            fmt::format("world: a snapshot of {} bodies for {}", snapshot.bodies.size(), body_count()));
    for (int b = 0; b < body_count(); ++b) {
        const auto fits = [&](const Nodes& rows) {
            return rows.rows() == elastic(b).node_count() && rows.allFinite();
        };
        const BodyState& state = snapshot.bodies[b];
        const PastStep before = snapshot.before.empty() ? PastStep{} : snapshot.before[b];
        const Nodes forces = snapshot.inner_forces.empty() ? Nodes{} : snapshot.inner_forces[b];
        const bool is_known = before.v.size() > 0 || before.inner_forces.size() > 0;
        if (!fits(state.x) || !fits(state.v) || (forces.size() > 0 && !fits(forces)) ||
            (is_known && !(fits(before.v) && fits(before.inner_forces) && snapshot.dt_before > 0)) ||
            (!snapshot.taken_at.empty() && !at(b).could_take(snapshot.taken_at[b])))
            throw std::invalid_argument(fmt::format("world: the snapshot of body {} does not fit it", b));
    }
    const FrictionStretches& stretches = snapshot.stretches;
    for (std::size_t i = 0; i < std::max(stretches.contacts.size(), stretches.ways.size()); ++i) {
        const bool is_there = i < stretches.contacts.size() && i < stretches.ways.size();
        const std::array<int, 6> contact = is_there ? stretches.contacts[i] : std::array<int, 6>{};
        const auto fits = [&](int body, int vertex) { return vertex == -1 || has_vertex(body, vertex); };
        const bool is_obstacle = contact[3] < 0 && -1 - contact[3] < std::ssize(obstacles_);
        if (!is_there || !has_vertex(contact[0], contact[1]) || !fits(contact[0], contact[2]) ||
            !(is_obstacle ||
              (has_vertex(contact[3], 0) && fits(contact[3], contact[4]) && fits(contact[3], contact[5]))) ||
            !stretches.ways[i].allFinite())
            throw std::invalid_argument(
                fmt::format("world: entry {} of the snapshot's friction does not fit the bodies", i));
    }
    for (const std::size_t count : {snapshot.broken.size(), snapshot.springs_before.size()})
        if (count != 0 && count != joints_.size())
            throw std::invalid_argument(
                fmt::format("world: a snapshot of {} joints for {}", count, joints_.size()));
    for (const JointLoad& load : snapshot.springs_before)
        for (const Momentum* side : {&load.on_a, &load.on_b})
            if (!side->linear.allFinite() || !side->angular.allFinite())
                throw std::invalid_argument("world: the snapshot's forces of springs are not finite");
    reset(snapshot);
    start_is_checked_ = false;
    reactions_.clear();
    for (Body& body : bodies_) {
        body.contact_forces.setZero();
        body.driven.start = body.driven.end = time_;  // moves from the restored places to its targets
    }
}

/// Whether these may be the places at which its grips took their nodes later.
bool World::Body::could_take(const std::vector<Nodes>& places) const {
    if (places.size() != grips.size()) return false;
    for (std::size_t g = 0; g < grips.size(); ++g) {
        const Eigen::Index rows = places[g].rows();
        const bool fits = rows == 0 || (takes_later(g) && rows == std::ssize(grips[g].nodes));
        if (!fits || !places[g].allFinite()) return false;
    }
    return true;
}

void World::reset(const WorldSnapshot& snapshot) {
    for (int b = 0; b < body_count(); ++b) {
        at(b).state = snapshot.bodies[b];
        at(b).inner_forces = snapshot.inner_forces.empty() ? Nodes{} : snapshot.inner_forces[b];
        at(b).before.reset();
        if (!snapshot.before.empty() && snapshot.before[b].v.size() > 0) at(b).before = snapshot.before[b];
        for (std::size_t g = 0; g < at(b).grips.size(); ++g)
            if (at(b).takes_later(g))
                at(b).grip_start[g] = snapshot.taken_at.empty() ? Nodes(0, 3) : snapshot.taken_at[b][g];
    }
    time_ = snapshot.time;
    dt_before_ = snapshot.dt_before;
    friction_memory_.restore(snapshot.stretches);
    broken_ = snapshot.broken;
    broken_.resize(joints_.size(), 0);
    springs_before_ = snapshot.springs_before;
    springs_before_.resize(joints_.size());
}

}  // namespace nbd
