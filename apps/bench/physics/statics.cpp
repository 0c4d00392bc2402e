// Balance by static increments. The length of a step is the share of the load that an increment adds.
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <utility>

#include "apps/bench/physics/physics_check.hpp"
#include "apps/bench/physics/physics_world.hpp"
#include "meshing/body/rigid_body.hpp"
#include "meshing/surface/quadratic_tets.hpp"

namespace nbd {
namespace {

using Eigen::Vector3d;

WorldConfig balance_config(const Vector3d& gravity = {0, 0, -standard_gravity}) {
    WorldConfig config{.gravity = gravity};
    config.limits.stretch = std::numeric_limits<double>::infinity();
    config.statics = StaticConfig{};
    return config;
}

/// Takes all increments, which must end in balance.
void load_fully(World& world, const PhysicsCase& c) { advance(world, c.dt, std::lround(1 / c.dt)); }

/// The force by one side on a body in the pose that was found.
Vector3d force_on(const World& world, int body, ReactionBy by, int number) {
    for (const Reaction& one : world.reactions())
        if (one.body == body && one.by == by && one.number == number) return one.force;
    return Vector3d::Zero();
}

/// A bar of quadratic tetrahedra along x from the origin on, clamped there, with a load at its end.
struct ClampedBar {
    double length, height;
    Solid solid;
    std::vector<int> end;

    ClampedBar(double L, double h, int cells, double young)
        : length(L),
          height(h),
          solid(
              [&] {
                  TetMesh mesh = brick({L, h, h}, {cells, 1, 1});
                  mesh.X.col(0).array() += L / 2;
                  return make_quadratic(std::move(mesh));
              }(),
              {.young = young, .poisson = 0}),
          end(nodes_at(solid.body.tets.X, [&](const Vector3d& p) { return p[0] > (1 - 1e-6) * L; })) {}

    double bending() const { return solid.body.material.young * std::pow(height, 4) / 12; }
    WorldBody body(double load) const {
        WorldBody made = solid.at({0, 0, 0});
        made.grips.push_back(
            {.nodes = nodes_at(solid.body.tets.X, [&](const Vector3d& p) { return p[0] < 1e-6 * length; })});
        made.loads.push_back({.kind = LoadKind::force, .value = {0, 0, -load}, .nodes = end});
        return made;
    }
    Vector3d way(const World& world) const {
        const Nodes u = world.state(0).x - solid.body.tets.X;
        return u(end, Eigen::all).colwise().mean();
    }
};

/// parameter: the share of the sag that its own weight makes, the rest a load at its end.
PhysicsOutcome static_cantilever(const PhysicsCase& c) {
    const double L = c.size, sag = 1e-3 * L;
    const ClampedBar bar(L, L / 10, 10, c.young);
    const double area = L * L / 100, shear = shear_coefficient(0) * c.young / 2 * area,
                 of_weight = std::pow(L, 4) / 8 / bar.bending() + L * L / 2 / shear,
                 of_end = std::pow(L, 3) / 3 / bar.bending() + L / shear;
    const double load = c.parameter * sag / of_weight;  // N/m
    World world = world_of(c, balance_config({0, 0, -load / (bar.solid.body.material.density * area)}),
                           {bar.body((1 - c.parameter) * sag / of_end)});
    load_fully(world, c);
    return relative_outcome(-bar.way(world).z(), sag);
}

/// parameter: the load over E I / L^2.
PhysicsOutcome elastica(const PhysicsCase& c) {
    // Ways of the end down by the length, by Mattiasson's table of elliptic integrals.
    constexpr std::pair<double, double> table[]{{1, 0.30172}, {2, 0.49346}, {5, 0.71379}, {10, 0.81061}};
    const auto* const row = std::ranges::find(table, c.parameter, &std::pair<double, double>::first);
    if (row == std::end(table)) throw std::logic_error("no reference for this load");
    const ClampedBar bar(c.size, c.size / 50, 40, c.young);
    World world =
        world_of(c, balance_config({0, 0, 0}), {bar.body(c.parameter * bar.bending() / (c.size * c.size))});
    load_fully(world, c);
    return relative_outcome(-bar.way(world).z() / c.size, row->second);
}

/// A cube between plates without friction, pressed by a twentieth.
PhysicsOutcome pressed_cube(const PhysicsCase& c) {
    const double L = c.size;
    const Solid solid(cube(c, 3), plain_material(c));
    Obstacle top{.shape = PlaneShape{.point = {0, 0, 1.004 * L}, .normal = {0, 0, -1}}, .friction = 0};
    top.motion = eased({.translation = {0, 0, -0.054 * L}, .duration = 1});
    World world =
        world_of(c, balance_config({0, 0, 0}), {solid.at({0, 0, 0.502 * L})}, {floor_plane(0), top});
    load_fully(world, c);
    const Nodes &X = solid.body.tets.X, &x = world.state(0).x;
    const auto height = [&](int side) {
        return x(nodes_at(X, [&](const Vector3d& p) { return side * p[2] > 0.499 * L; }), 2).mean();
    };
    const double strain = 1 - (height(1) - height(-1)) / L;
    return relative_outcome(-force_on(world, 0, ReactionBy::obstacle, 1).z(), c.young * L * L * strain);
}

/// Two cubes on a floor: the larger error of the two contacts' forces, relative to the weight on them.
PhysicsOutcome stacked_cubes(const PhysicsCase& c) {
    const Solid solid(cube(c), plain_material(c));
    World world = world_of(c, balance_config(),
                           {solid.at({0, 0, 0.502 * c.size}), solid.at({0.1 * c.size, 0, 1.506 * c.size})},
                           {floor_plane(0.5)});
    load_fully(world, c);
    const Vector3d weight(0, 0, standard_gravity * world.elastic(0).mass());
    return zero_outcome(
        std::max((force_on(world, 0, ReactionBy::obstacle, 0) - 2 * weight).norm() / (2 * weight.norm()),
                 (force_on(world, 0, ReactionBy::body, 1) + weight).norm() / weight.norm()));
}

/// parameter: the slope's tangent over the coefficient of friction; above 1 it must be told that nothing
/// holds the block. The error: of the force on it, relative to its weight.
PhysicsOutcome held_on_slope(const PhysicsCase& c) {
    constexpr double slope = 0.3;
    const Eigen::Matrix3d R = Eigen::AngleAxisd(slope, Vector3d::UnitY()).matrix();
    const Solid solid(brick(c.size * Vector3d(1, 1, 0.5), {3, 3, 2}), plain_material(c));
    World world = world_of(c, balance_config(),
                           {solid.at(R.col(2) * 0.251 * c.size, Vector3d::Zero(), Vector3d::Zero(), R)},
                           {{.shape = PlaneShape{.point = {0, 0, 0}, .normal = R.col(2)},
                             .friction = std::tan(slope) / c.parameter}});
    if (c.parameter > 1) {
        const std::string failure = world.step(c.dt).failure;
        return zero_outcome(
            failure.find("nothing holds") == std::string::npos ? std::numeric_limits<double>::infinity() : 0);
    }
    load_fully(world, c);
    const double weight = standard_gravity * world.elastic(0).mass();
    return zero_outcome((force_on(world, 0, ReactionBy::obstacle, 0) - weight * Vector3d::UnitZ()).norm() /
                        weight);
}

/// A rigid cube that a rope takes by a corner: how far its centre is from below the hook, by its size, or the
/// error of the rope's force, relative to its weight.
PhysicsOutcome hung_by_rope(const PhysicsCase& c) {
    const auto cube = std::make_shared<const ElasticBody>(
        make_rigid_body("cube", box_surface(Vector3d::Constant(c.size), {2, 2, 2}), 1000));
    World world = world_of(c, balance_config(), {alone(cube)});
    const Vector3d corner = Vector3d(0.5, 0.5, 0.5) * c.size, hook(0, 0, 2 * c.size);
    world.add_joint({.kind = CordJoint{.from = corner, .to = hook, .pulls_only = true}});
    load_fully(world, c);
    const double weight = standard_gravity * world.elastic(0).mass();
    return zero_outcome(
        std::max(mass_centre(world, 0).head<2>().norm() / c.size,
                 (force_on(world, 0, ReactionBy::joint, 0) - weight * Vector3d::UnitZ()).norm() / weight));
}

}  // namespace

std::vector<PhysicsCheck> static_checks() {
    const auto range = [](std::vector<double> parameters, std::vector<double> increments = {0.5}) {
        return PhysicsRange{.sizes = {0.01, 1, 10},
                            .steps = std::move(increments),
                            .moduli = {1e3, 1e6, 1e9},
                            .far = FarBody::none,
                            .parameters = std::move(parameters)};
    };
    constexpr double none = std::numeric_limits<double>::quiet_NaN();
    return {
        {"static_cantilever",
         "A static cantilever of quadratic tetrahedra sags under its weight and a load at its end as "
         "Timoshenko's beam.",
         "sag of the end, m", 0.01, all_cases(range({0, 1}), 3), static_cantilever,
         "share of the sag by weight"},
        {"elastica",
         "A thin static cantilever bends under a load at its end as the elastica (Bisshopp and Drucker), in "
         "one increment as in five.",
         "way of the end down over the length", 0.005, all_cases(range({1, 2, 5, 10}, {0.2, 1}), 9), elastica,
         "load over E I / L2"},
        {"pressed_cube", "A cube between plates without friction presses by E A e.", "force, N", 2e-3,
         all_cases(range({none}, {0.2, 1}), 3), pressed_cube},
        {"stacked_cubes", "Two static cubes on a floor: each contact carries the weight above it.",
         "error of a force over the weight", 1e-5, all_cases(range({none}), 2, carries_itself(0.2)),
         stacked_cubes},
        {"held_on_slope",
         "Friction holds a static block where mu >= tan a; where it does not, that is told, not solved.",
         "error of the force over the weight", 1e-5, all_cases(range({0.9, 1.1}), 2, carries_itself(0.2)),
         held_on_slope, "tan a / mu"},
        {"hung_by_rope", "A rigid cube hangs below its hook, and its rope bears its weight.",
         "error by its size or weight", 1e-4, all_cases(range({none}), 2), hung_by_rope}};
}

}  // namespace nbd
