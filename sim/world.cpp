#include "sim/world.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

#include "sim/backward_euler.hpp"

namespace nbd {
namespace {

double microseconds_since(std::chrono::steady_clock::time_point start) {
    return std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - start).count();
}

Eigen::Vector3d mean_velocity(const ElasticBody& elastic, const BodyState& state) {
    return state.v.transpose() * elastic.node_masses() / elastic.mass();
}

/// Of a contact layer between two materials, or of one against something rigid, Pa.
double layer_modulus(const ElasticBody& a) { return a.material().young; }
double layer_modulus(const ElasticBody& a, const ElasticBody& b) {
    return 2 / (1 / a.material().young + 1 / b.material().young);
}

/// Why a pose is unusable; empty where it is not.
std::string pose_failure(int body, const ElementReport& elements, const ElementPose& pose,
                         const FailureLimits& limits) {
    if (elements.non_finite > 0)
        return fmt::format("body {}: {} tetrahedra are not finite, the first is {}", body,
                           elements.non_finite, elements.first_non_finite);
    const auto count = static_cast<double>(pose.F.size());
    if (elements.inverted > limits.inverted_share * count)
        return fmt::format("body {}: {} of {} tetrahedra are inverted, the first is {}", body,
                           elements.inverted, pose.F.size(), elements.first_inverted);
    for (std::size_t t = 0; t < pose.F.size(); ++t)
        if (pose.F[t].norm() > limits.stretch)
            return fmt::format("body {}: tetrahedron {} is stretched {:.1f} times, more than {}", body, t,
                               pose.F[t].norm(), limits.stretch);
    return {};
}

}  // namespace

World::World(const WorldConfig& config) : config_(config), solver_(config.linear, config.factors) {
    check_contact_config(config.contact);
    if (!config.gravity.allFinite()) throw std::invalid_argument("world: gravity is not finite");
    if (!(config.limits.inverted_share >= 0) || !(config.limits.stretch > 1))
        throw std::invalid_argument("world: failure limits need inverted_share >= 0 and stretch > 1");
    if (!(config.linear.tolerance > 0 && config.linear.tolerance < 1) || config.linear.most_iterations < 1)
        throw std::invalid_argument(
            "world: the linear solver needs 0 < tolerance < 1 and at least one iteration");
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
    std::vector<Nodes> grip_start;
    Grip all;
    for (const Grip& grip : body.grips) {
        check_grip(grip, nodes);
        all.nodes.insert(all.nodes.end(), grip.nodes.begin(), grip.nodes.end());
        grip_start.push_back(body.state.x(grip.nodes, Eigen::all));
    }
    check_grip(all, nodes);  // no node in two hands
    ContactSurface surface(std::move(body.W), std::move(body.F), elastic.rest().X);
    surface.update(body.state.x);
    std::unique_ptr<PosedTree> tree;
    if (body.tree) {
        if (body.tree->vertex_count != surface.vertex_count() || body.tree->faces != surface.F())
            throw std::invalid_argument("world: a collision tree belongs to another surface than the body's");
        tree = std::make_unique<PosedTree>(body.tree, body.bounds, body.margin);
    }
    const int index = body_count();
    for (int other = 0; tree && other < index; ++other)
        if (at(other).tree) pairs_.push_back({other, index, BodyContactFinder(other, index)});
    systems_.emplace_back(elastic);
    bodies_.push_back({.elastic = std::move(body.elastic),
                       .surface = std::move(surface),
                       .tree = std::move(tree),
                       .state = std::move(body.state),
                       .forces = Nodes::Zero(nodes, 3),
                       .contact_forces = Nodes::Zero(nodes, 3),
                       .grips = std::move(body.grips),
                       .grip_start = std::move(grip_start),
                       .pose = {}});
    first_unknown_.push_back(first_unknown_.back() + 3 * nodes);
    return index;
}

void World::add_obstacle(Obstacle obstacle) {
    check_obstacle(obstacle);
    obstacles_.push_back(std::move(obstacle));
}

double World::thickness() const noexcept {
    if (config_.contact.thickness > 0) return config_.contact.thickness;
    double smallest = std::numeric_limits<double>::infinity();
    for (const Body& body : bodies_) smallest = std::min(smallest, body.surface.rest_diagonal());
    return 0.01 * smallest;
}

/// Largest speed of a node relative to a frame that moves uniformly.
double World::fastest(const Body& body, const Eigen::Vector3d& frame) const {
    return (body.state.v.rowwise() - frame.transpose()).rowwise().norm().maxCoeff();
}

void World::find_body_contacts(BodyPair& pair, double dt, WorldReport& report) {
    const Body &a = at(pair.a), &b = at(pair.b);
    const Eigen::Vector3d frame =
        (mean_velocity(*a.elastic, a.state) + mean_velocity(*b.elastic, b.state)) / 2;
    // As far as points can come within this step, but not so far that a tip which swings somewhere fills the
    // list with pairs that never meet; and all that overlapped before. What is fast enough to pass that is
    // found inside the other body a step later.
    const double approach = std::min(dt * (fastest(a, frame) + fastest(b, frame)), 2 * thickness());
    const double overlap =
        std::min(deepest_, 0.25 * std::min(a.surface.rest_diagonal(), b.surface.rest_diagonal()));
    const double reach = thickness() + approach + overlap;
    const auto start = std::chrono::steady_clock::now();
    const auto face_pairs = query_.within(*a.tree, *b.tree, static_cast<float>(reach));
    report.collision_us += microseconds_since(start);
    report.nodes_bounded += query_.counters().nodes_bounded;
    report.face_pairs += static_cast<long>(face_pairs.size());
    const std::size_t first = contacts_.size();
    pair.finder.find(a.surface, b.surface, face_pairs, reach, contacts_);
    const double modulus = layer_modulus(*a.elastic, *b.elastic);
    for (Contact& contact : std::span(contacts_).subspan(first)) {
        contact.friction = config_.contact.friction;
        contact.stiffness = config_.contact.stiffness_scale * modulus * contact.area / thickness();
    }
}

void World::find_contacts(double dt, WorldReport& report) {
    contacts_.clear();
    for (Body& body : bodies_) {
        body.surface.update(body.state.x);
        const auto start = std::chrono::steady_clock::now();
        if (body.tree) body.tree->begin_pose(body.surface.x_float());
        report.update_us += microseconds_since(start);
    }
    for (int b = 0; b < body_count(); ++b) {
        const Body& body = at(b);
        const double modulus = config_.contact.stiffness_scale * layer_modulus(*body.elastic);
        const std::size_t first = contacts_.size();
        for (const Obstacle& obstacle : obstacles_)
            find_obstacle_contacts(b, body.surface, obstacle, time_,
                                   thickness() + dt * fastest(body, obstacle.velocity), contacts_);
        for (Contact& contact : std::span(contacts_).subspan(first))
            contact.stiffness = modulus * contact.area / thickness();
    }
    for (BodyPair& pair : pairs_) find_body_contacts(pair, dt, report);
    deepest_ = 0;
    for (const Contact& contact : contacts_) deepest_ = std::max(deepest_, -contact.gap);
    report.deepest_penetration = deepest_;
}

PrescribedNodes World::prescribed(const Body& body, double dt) const {
    PrescribedNodes result;
    std::vector<Eigen::Vector3d> v;
    for (std::size_t g = 0; g < body.grips.size(); ++g) {
        const Grip& grip = body.grips[g];
        if (time_ >= grip.release) continue;
        for (std::size_t k = 0; k < grip.nodes.size(); ++k) {
            const Eigen::Vector3d x0 = body.grip_start[g].row(static_cast<Eigen::Index>(k));
            const Eigen::Vector3d x = body.state.x.row(grip.nodes[k]);
            result.nodes.push_back(grip.nodes[k]);
            v.push_back((grip_target(grip, x0, time_ + dt) - x) / dt);
        }
    }
    result.v.resize(static_cast<Eigen::Index>(v.size()), 3);
    for (std::size_t i = 0; i < v.size(); ++i) result.v.row(static_cast<Eigen::Index>(i)) = v[i];
    return result;
}

Eigen::VectorXd World::stacked_velocities() const {
    Eigen::VectorXd v(first_unknown_.back());
    for (std::size_t b = 0; b < bodies_.size(); ++b)
        v.segment(first_unknown_[b], bodies_[b].state.v.size()) =
            bodies_[b].state.v.reshaped<Eigen::RowMajor>();
    return v;
}

void World::build_systems(double dt) {
    for (std::size_t b = 0; b < bodies_.size(); ++b)
        systems_[b].assemble(bodies_[b].state, dt, {.gravity = config_.gravity, .forces = bodies_[b].forces});
    for (std::size_t b = 0; b < bodies_.size(); ++b) systems_[b].prescribe(prescribed(bodies_[b], dt));
}

WorldReport World::step(double dt) {
    if (!(dt > 0) || !std::isfinite(dt))
        throw std::invalid_argument(fmt::format("world: dt is {}, but must be > 0", dt));
    WorldReport report;
    find_contacts(dt, report);
    std::vector<const ContactSurface*> surfaces;
    for (const Body& body : bodies_) surfaces.push_back(&body.surface);
    Eigen::VectorXd v = stacked_velocities();
    solver_.begin(contacts_, surfaces, first_unknown_, config_.contact, thickness(), dt, v);
    try {
        build_systems(dt);
        const ContactSolveReport solved = solver_.solve(systems_, v);
        report.contacts = solved.active;
        report.solver_iterations = solved.linear_iterations;
        report.solver_converged = solved.converged;
        advance(dt, v, report);
    } catch (const std::runtime_error& error) {
        report.failure = error.what();
    }
    if (!report.failure.empty()) report.failure = fmt::format("at {:.6g} s: {}", time_ + dt, report.failure);
    time_ += dt;
    report.time = time_;
    measure(report);
    return report;
}

void World::advance(double dt, const Eigen::VectorXd& v, WorldReport& report) {
    const Eigen::VectorXd impulses = solver_.impulses(v);
    for (int b = 0; b < body_count(); ++b) {
        Body& body = at(b);
        const auto first = first_unknown_[static_cast<std::size_t>(b)];
        const Eigen::Map<const Nodes> end(v.data() + first, body.state.v.rows(), 3);
        const Nodes x = body.state.x + dt * end;
        body.elastic->pose(x, body.pose);
        const ElementReport elements = body.elastic->check(body.pose);
        report.inverted_elements += elements.inverted;
        const std::string failure = pose_failure(b, elements, body.pose, config_.limits);
        if (!failure.empty()) {
            report.failure = failure;
            body.elastic->pose(body.state.x, body.pose);
            continue;
        }
        body.state.x = x;
        body.state.v = end;
        body.contact_forces = Eigen::Map<const Nodes>(impulses.data() + first, body.state.v.rows(), 3) / dt;
    }
}

void World::measure(WorldReport& report) const {
    for (const Body& body : bodies_) {
        report.kinetic_energy += kinetic_energy(*body.elastic, body.state.v);
        if (!body.pose.F.empty()) report.elastic_energy += body.elastic->energy(body.pose);
        const Eigen::Vector3d moment = body.state.x.transpose() * body.elastic->node_masses();
        report.gravity_energy -= config_.gravity.dot(moment);
    }
}

std::vector<FacePair> World::intersecting(int a, int b) {
    for (const int index : {a, b}) {
        Body& body = at(index);
        if (!body.tree)
            throw std::invalid_argument(fmt::format("world: body {} has no collision tree", index));
        body.surface.update(body.state.x);
        body.tree->begin_pose(body.surface.x_float());
    }
    const auto pairs = query_.intersecting(*at(a).tree, *at(b).tree);
    return {pairs.begin(), pairs.end()};
}

bool World::has_vertex(int body, int vertex) const {
    return body >= 0 && body < body_count() && vertex >= 0 && vertex < at(body).surface.vertex_count();
}

WorldSnapshot World::snapshot() const {
    WorldSnapshot snapshot{.time = time_, .overlap = deepest_, .bodies = {}, .sides = {}};
    for (const Body& body : bodies_) snapshot.bodies.push_back(body.state);
    for (const BodyPair& pair : pairs_) pair.finder.save_sides(snapshot.sides);
    return snapshot;
}

void World::restore(const WorldSnapshot& snapshot) {
    if (static_cast<int>(snapshot.bodies.size()) != body_count())
        throw std::invalid_argument(
            fmt::format("world: a snapshot of {} bodies for {}", snapshot.bodies.size(), body_count()));
    for (int b = 0; b < body_count(); ++b) {
        const BodyState& state = snapshot.bodies[static_cast<std::size_t>(b)];
        if (state.x.rows() != elastic(b).node_count() || state.v.rows() != elastic(b).node_count() ||
            !state.x.allFinite() || !state.v.allFinite())
            throw std::invalid_argument(fmt::format("world: the snapshot of body {} does not fit it", b));
    }
    const ContactSides& sides = snapshot.sides;
    for (std::size_t i = 0; i < std::max(sides.vertices.size(), sides.normals.size()); ++i)
        if (i >= sides.vertices.size() || i >= sides.normals.size() ||
            !has_vertex(sides.vertices[i][0], sides.vertices[i][2]) || !has_vertex(sides.vertices[i][1], 0) ||
            !sides.normals[i].allFinite())
            throw std::invalid_argument(
                fmt::format("world: entry {} of the snapshot's contact sides does not fit the bodies", i));
    for (BodyPair& pair : pairs_) pair.finder.restore_sides(snapshot.sides);
    for (int b = 0; b < body_count(); ++b) {
        at(b).state = snapshot.bodies[static_cast<std::size_t>(b)];
        at(b).contact_forces.setZero();
    }
    time_ = snapshot.time;
    deepest_ = snapshot.overlap;
}

}  // namespace nbd
