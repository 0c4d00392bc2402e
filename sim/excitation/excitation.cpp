#include "sim/excitation/excitation.hpp"

#include <fmt/format.h>

#include <cmath>
#include <numbers>
#include <stdexcept>
#include <utility>

#include "meshing/body/make_body.hpp"
#include "meshing/body/rigid_body.hpp"
#include "sim/world/hang_on_body.hpp"
#include "sim/world/start_check.hpp"

namespace nbd {
namespace {

/// A patch force with its shares among the nodes.
struct SpreadForce {
    PatchForce patch;
    std::vector<std::pair<int, double>> shares;  // (node, share), summing to 1
};

SpreadForce spread(const PatchForce& patch, const ElasticBody& elastic) {
    SpreadForce result{.patch = patch, .shares = {}};
    const Nodes& X = elastic.rest().X;
    double total = 0;
    for (int i = 0; i < X.rows(); ++i) {
        const double u = (X.row(i) - X.row(patch.node)).squaredNorm() / (patch.radius * patch.radius);
        if (u >= 1) continue;
        const double share = (1 - u) * (1 - u) * elastic.node_masses()[i];
        result.shares.emplace_back(i, share);
        total += share;
    }
    for (auto& [node, share] : result.shares) share /= total;
    return result;
}

void set_forces(const std::vector<SpreadForce>& forces, double time, Nodes& out) {
    out.setZero();
    for (const SpreadForce& f : forces) {
        const double u = (time - f.patch.start) / f.patch.duration;
        if (u <= 0 || u >= 1) continue;
        const double swell = std::sin(std::numbers::pi * u) * std::sin(std::numbers::pi * u);
        for (const auto& [node, share] : f.shares) out.row(node) += swell * share * f.patch.force.transpose();
    }
}

std::shared_ptr<const CollisionTree> make_tree(const Body& body) {
    CollisionTree tree = make_exact_tree(body.surface.X.cast<float>(), body.surface.F);
    hang_on_body(tree, body, "dataset");
    return std::make_shared<const CollisionTree>(std::move(tree));
}

/// The body with the surface by which it makes contact.
std::shared_ptr<const Body> contact_body(const std::shared_ptr<const Body>& body, bool own_surface) {
    constexpr Eigen::Index many = 4;   // times the vertices of the boundary
    constexpr double outside = -1e-6;  // weight of a vertex that is not inside
    const bool is_inside = body->W.nonZeros() > 0 && body->W.coeffs().minCoeff() >= outside;
    if (own_surface || !is_inside) return body;
    try {
        // The nodes of edges move the middles of edges alone.
        const int levels = body->tets.is_quadratic() ? 1 : 0;
        Body boundary = make_body(body->name, body->tets, body->material, levels);
        if (body->W.rows() > many * boundary.W.rows())
            return std::make_shared<const Body>(std::move(boundary));
    } catch (const std::invalid_argument&) {  // tetrahedra whose boundary is no closed surface
    }
    return body;
}

/// The body as it moves in trajectories: where the boundary of its tetrahedra makes contact, they are full,
/// or what they have of material there would give way.
std::shared_ptr<const Body> moving_body(std::shared_ptr<const Body> body, bool own_surface) {
    if (is_rigid(body->tets))
        throw std::invalid_argument("a rigid body does not deform, so it has no training poses");
    if (body->tets.fill.rows() == 0 || contact_body(body, own_surface) == body) return body;
    Body full = *body;
    full.tets.fill = {};
    return std::make_shared<const Body>(std::move(full));
}

World make_world(const Recipe& recipe, const Body& body, const std::shared_ptr<const ElasticBody>& elastic,
                 const std::shared_ptr<const CollisionTree>& tree,
                 const std::shared_ptr<RestHierarchies>& hierarchies) {
    WorldConfig config;
    // Vibrations that steps do not resolve are no poses to learn from.
    config.step.integrator = TimeIntegrator::backward_euler;
    config.gravity = recipe.gravity;
    config.contact.tolerance = 1e-3;  // training poses need variety, not precise friction
    config.limits.inverted_share = 0.02;
    config.hierarchies = hierarchies;
    World world(config);
    for (Obstacle& obstacle : recipe_obstacles(recipe)) world.add_obstacle(std::move(obstacle));
    const Eigen::RowVector3d centre = body.tets.X.colwise().mean();
    const Nodes X = body.tets.X.rowwise() - centre;
    const WorldBody any{
        .elastic = elastic, .W = body.W, .F = body.surface.F, .tree = tree, .bounds = BoundKind::automatic};
    WorldBody self = any;
    for (const Hand& hand : recipe.grips) self.grips.push_back(hand.grip());
    self.state.x = X * recipe.rotation.transpose();
    self.state.v = (self.state.x * recipe.gradient.transpose()).rowwise() + recipe.velocity.transpose();
    world.add_body(std::move(self));
    if (recipe.thrown) {
        WorldBody copy = any;
        copy.state.x =
            (X * recipe.thrown->rotation.transpose()).rowwise() + recipe.thrown->centre.transpose();
        copy.state.v = Nodes::Zero(X.rows(), 3).rowwise() + recipe.thrown->velocity.transpose();
        world.add_body(std::move(copy));
    }
    return world;
}

}  // namespace

Excitation::Excitation(Body body, const ExcitationConfig& config)
    : body_(moving_body(std::make_shared<const Body>(std::move(body)), config.own_surface)),
      config_(config),
      elastic_(std::make_shared<const ElasticBody>(*body_)),
      recipes_(body_, config),
      contact_(contact_body(body_, config.own_surface)),
      tree_(make_tree(*contact_)),
      hierarchies_(std::make_shared<RestHierarchies>()) {}

World Excitation::start(int index) const {
    return make_world(recipes_.draw(index), *contact_, elastic_, tree_, hierarchies_);
}

TrajectoryResult Excitation::run(int index, const OnFrame& on_frame, int steps_per_frame) const {
    if (steps_per_frame == 0) steps_per_frame = config_.steps_per_frame;
    if (steps_per_frame < 0)
        throw std::invalid_argument(
            fmt::format("excitation: {} steps per frame, but must be > 0", steps_per_frame));
    const Recipe recipe = recipes_.draw(index);
    TrajectoryResult result;
    World world = make_world(recipe, *contact_, elastic_, tree_, hierarchies_);
    for (const StartFault& fault : start_faults(world, {"the body", "the thrown copy"}))
        if (fault.overlaps && result.start_fault.empty()) result.start_fault = fault.text;
    try {
        world.check_start();
    } catch (const std::invalid_argument& error) {
        result.failure = error.what();
        return result;
    }
    std::vector<SpreadForce> forces;
    for (const PatchForce& patch : recipe.forces) forces.push_back(spread(patch, *elastic_));
    const double dt = recipe.frame_interval / steps_per_frame;
    const int warm_up = std::ceil(recipe.first_frame / dt);
    const int steps = warm_up + (config_.frames - 1) * steps_per_frame;
    int troubled = 0;
    for (int step = 1; step <= steps; ++step) {
        set_forces(forces, world.time() + dt / 2, world.forces(0));
        const WorldReport report = world.step(dt);
        if (!report.failure.empty()) {
            result.failure = report.failure;
            return result;
        }
        troubled += spoils_pose(report.trouble);
        if (step < warm_up || (step - warm_up) % steps_per_frame != 0) continue;
        on_frame({world.time(), world.state(0).x, report.contacts, std::exchange(troubled, 0), world});
        ++result.frames;
    }
    return result;
}

}  // namespace nbd
