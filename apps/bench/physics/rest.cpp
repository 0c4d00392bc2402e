// Bodies at rest, or carried along: on floors, on each other, on belts.
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "apps/bench/physics/physics_check.hpp"
#include "apps/bench/physics/physics_world.hpp"

namespace nbd {
namespace {

using Eigen::Vector3d;

/// Mean height of the nodes of a body that are at its end along z at rest. side: -1 the lower end, 1 the
/// upper.
double end_height(const World& world, int body, int side) {
    const Nodes& X = world.elastic(body).rest().X;
    const double low = X.col(2).minCoeff(), high = X.col(2).maxCoeff(), near = 1e-6 * (high - low);
    const std::vector<int> nodes =
        nodes_at(X, [&](const Vector3d& p) { return side < 0 ? p[2] < low + near : p[2] > high - near; });
    return world.state(body).x(nodes, 2).mean();
}

/// Steps until `end`.
void run_until(World& world, const PhysicsCase& c, double end) {
    while (world.time() < end - c.dt / 2) advance(world, c.dt);
}

/// Seconds in which a body of this size sinks together under its weight and comes to rest, about.
double settling(const PhysicsCase& c) {
    const double sound = speed_of_sound(c);
    return std::clamp(40 * c.size / sound, 0.5, 20.0);
}

/// Two cubes on each other, a five-hundredth of their size apart at first.
PhysicsOutcome rest_height(const PhysicsCase& c, const Vector3d& origin) {
    Material material = plain_material(c);
    material.rayleigh_mass = speed_of_sound(c) / c.size;  // comes to rest soon
    const Solid solid(cube(c), material);
    World world = world_of(c, config_of(),
                           {solid.at(origin + Vector3d(0, 0, c.size * 0.502)),
                            solid.at(origin + Vector3d(0, 0, c.size * (0.502 + 1.002)))},
                           {floor_plane(0.5, origin[2])});
    run_until(world, c, settling(c));
    const double below = (end_height(world, 0, -1) - origin[2]) / c.size,
                 between = (end_height(world, 1, -1) - end_height(world, 0, 1)) / c.size;
    return zero_outcome(std::abs(below) > std::abs(between) ? below : between);
}

/// Way up of the cube's centre, by its size, in the first half second.
PhysicsOutcome start_on_floor(const PhysicsCase& c) {
    World world = world_of(c, config_of(), {Solid(cube(c), plain_material(c)).at({0, 0, c.size / 2})},
                           {floor_plane(0.5)});
    world.part_touching();
    const double start = mass_centre(world, 0)[2];
    double highest = start;
    while (world.time() < 0.5 - c.dt / 2) {
        advance(world, c.dt);
        highest = std::max(highest, mass_centre(world, 0)[2]);
    }
    return zero_outcome((highest - start) / c.size);
}

/// How far a body that stands drifts in `time`, told by what it does in the later part of `run` seconds.
double drift(World& world, const PhysicsCase& c, int body, double settled, double run, double time) {
    run_until(world, c, settled);
    const Vector3d before = mass_centre(world, body);
    const double start = world.time();
    run_until(world, c, run);
    return (mass_centre(world, body) - before).norm() * std::max(1.0, time / (world.time() - start));
}

/// parameter: seconds of the run.
PhysicsOutcome tower(const PhysicsCase& c) {
    const Solid solid(cube(c, 1), {.young = c.young});
    std::vector<WorldBody> cubes;
    for (int b = 0; b < 5; ++b) cubes.push_back(solid.at({0, 0, c.size * (0.505 + 1.01 * b)}));
    World world = world_of(c, config_of(), std::move(cubes), {floor_plane(0.5)});
    run_until(world, c, 5);
    const Vector3d before = mass_centre(world, 4);
    const double start = world.time();
    run_until(world, c, c.parameter);
    if (mass_centre(world, 4)[2] < 4 * c.size) throw std::runtime_error("the tower fell over");
    constexpr double ten_minutes = 600;
    return zero_outcome((mass_centre(world, 4) - before).head<2>().norm() * ten_minutes /
                        (world.time() - start));
}

/// An arch of wedges over a half circle whose mean radius is the case's size; a third of that thick.
PhysicsOutcome arch(const PhysicsCase& c) {
    constexpr int wedges = 7;
    constexpr double thickness = 0.35, depth = 0.4, gap = 0.002;
    const Material material{.young = c.young};
    std::vector<WorldBody> stones;
    for (int k = 0; k < wedges; ++k) {
        TetMesh mesh = brick({1, 1, 1}, {1, 1, 1});
        for (int i = 0; i < mesh.X.rows(); ++i) {
            const Vector3d p = mesh.X.row(i).transpose() + Vector3d::Constant(0.5);
            const double angle = std::numbers::pi * (k + gap + (1 - 2 * gap) * p[0]) / wedges,
                         r = c.size * (1 + thickness * (p[2] - 0.5));
            mesh.X.row(i) << -r * std::cos(angle), c.size * depth * (p[1] - 0.5), r * std::sin(angle);
        }
        const Vector3d lift(0, 0, 1.5 * gap * c.size);
        stones.push_back(Solid(std::move(mesh), material).at(lift));
    }
    World world = world_of(c, config_of(), std::move(stones), {floor_plane(0.8)});
    const double key = mass_centre(world, wedges / 2)[2];
    const double moved = drift(world, c, wedges / 2, 3, 6, 60) / c.size;
    if (mass_centre(world, wedges / 2)[2] < 0.8 * key) throw std::runtime_error("the arch fell down");
    return zero_outcome(moved);
}

/// Two cards lean on each other at 25 degrees from upright.
PhysicsOutcome cards(const PhysicsCase& c) {
    constexpr double lean = 25 * std::numbers::pi / 180, thickness = 0.06;
    const Solid card(brick(c.size * Vector3d(thickness, 0.7, 1), {1, 2, 3}), {.young = c.young});
    const double half_width = 0.5 * c.size * (std::sin(lean) + thickness * std::cos(lean)) + 0.001 * c.size;
    const double height = 0.5 * c.size * (std::cos(lean) + thickness * std::sin(lean)) + 0.001 * c.size;
    std::vector<WorldBody> both;
    for (const int side : {-1, 1})
        both.push_back(card.at({side * half_width, 0, height}, {0, 0, 0}, {0, 0, 0},
                               Eigen::AngleAxisd(-side * lean, Vector3d::UnitY()).matrix()));
    World world = world_of(c, config_of(), std::move(both), {floor_plane(0.7)});
    const double moved = drift(world, c, 0, 3, 6, 60) / c.size;
    if (mass_centre(world, 0)[2] < 0.8 * height) throw std::runtime_error("the cards fell down");
    return zero_outcome(moved);
}

/// parameter: slope in degrees. The coefficient is 1.5 times what rolling needs.
PhysicsOutcome roll(const PhysicsCase& c) {
    const double slope = c.parameter * std::numbers::pi / 180;
    WorldConfig config = config_of();
    config.gravity = standard_gravity * Vector3d(std::sin(slope), 0, -std::cos(slope));
    const Solid solid(ball(c.size / 2, 3), undamped_material(c));
    World world =
        world_of(c, config, {solid.at({0, 0, 0.501 * c.size})}, {floor_plane(1.5 * 2 / 7 * std::tan(slope))});
    // Mean acceleration over a turn or so, after the ball has begun to roll.
    const double expected = 5.0 / 7 * standard_gravity * std::sin(slope);
    const double turn = std::sqrt(2 * std::numbers::pi * c.size / expected);
    run_until(world, c, 0.3 * turn);
    const Vector3d before = momentum(world, 0);
    const double start = world.time(), mass = world.elastic(0).mass();
    run_until(world, c, 1.3 * turn);
    const Vector3d gained = (momentum(world, 0) - before) / mass;
    // The mesh is not quite round: what it lacks in inertia is known.
    const Nodes& X = world.elastic(0).rest().X;
    const double inertia = X.leftCols<2>().rowwise().squaredNorm().dot(world.elastic(0).node_masses()),
                 truth = standard_gravity * std::sin(slope) / (1 + inertia / (mass * c.size * c.size / 4));
    return relative_outcome(gained[0] / (world.time() - start), truth);
}

PhysicsOutcome belt(const PhysicsCase& c) {
    constexpr double mu = 0.3, speed = 1;
    Obstacle moving = floor_plane(mu);
    moving.motion = travel({speed, 0, 0});
    World world =
        world_of(c, config_of(), {Solid(cube(c), plain_material(c)).at({0, 0, 0.51 * c.size})}, {moving});
    const double mass = world.elastic(0).mass(), time_to_speed = speed / (mu * standard_gravity);
    run_until(world, c, 0.6 * time_to_speed);
    const Vector3d v = momentum(world, 0) / mass;
    // The belt has pressed with the weight, and with what changed the vertical momentum.
    PhysicsOutcome sliding = relative_outcome(v[0], mu * (standard_gravity * world.time() + v[2]));
    run_until(world, c, 2 * time_to_speed + settling(c));
    const PhysicsOutcome along = relative_outcome(momentum(world, 0)[0] / mass, speed);
    return along.error > sliding.error ? along : sliding;
}

/// Balls of one ratio of weight to stiffness, which flattens them by more than the faces of their surface do.
std::vector<PhysicsCase> rolling_balls() {
    std::vector<PhysicsCase> cases = all_cases({.sizes = {0.02, 0.2, 2},
                                                .steps = steps_from_1_ms,
                                                .moduli = {0},
                                                .far = FarBody::some,
                                                .parameters = {10, 30}},
                                               11);
    for (PhysicsCase& c : cases) c.young = 1e6 * c.size / 0.2;
    return cases;
}

/// Structures of stiff parts, which their own weight shortens by no more than `share`.
std::vector<PhysicsCase> standing(const std::vector<double>& sizes, double share) {
    return all_cases({.sizes = sizes, .steps = steps_from_1_ms, .moduli = {1e7, 1e9}, .far = FarBody::some},
                     11, carries_itself(share));
}

}  // namespace

std::vector<PhysicsCheck> rest_checks() {
    std::vector<PhysicsCase> towers = all_cases(
        {.steps = {5e-3, 1e-2, 2e-2}, .moduli = {2e5, 1e7, 1e9}, .far = FarBody::some, .parameters = {20}},
        17, carries_itself(0.02));
    towers.push_back({.size = 0.1, .dt = 1e-2, .young = 2e5, .parameter = 600});
    const PhysicsRange far_away{
        .sizes = {0.1, 10}, .steps = {5e-3}, .moduli = {1e6, 1e9}, .far = FarBody::none};
    return {{"tower", "A tower of five cubes stands for ten minutes: its top drifts by less than 0.1 mm.",
             "way of the top in ten minutes, m", 1e-4, towers, tower, "seconds"},
            {"arch",
             "An arch of seven wedges, a third as thick as its radius, stands by friction alone (Couplet).",
             "way of the keystone in a minute over the radius", 1e-3, standing({0.1, 1, 10}, 0.01), arch},
            {"cards",
             "Two cards that lean on each other at 25 degrees stand with a coefficient of 0.7, "
             "where half the tangent of the angle is enough.",
             "way of a card in a minute over its length", 1e-3, standing({0.01, 0.1, 1}, 0.001), cards},
            {"rolling_ball", "A ball rolls down a slope with 5/7 g sin if the coefficient is above 2/7 tan.",
             "acceleration, m/s2", 0.01, rolling_balls(), roll, "degrees"},
            {"belt", "A cube on a belt gains mu g t until it moves along with it.", "speed, m/s", 0.01,
             all_cases({.steps = steps_from_1_ms, .far = FarBody::some}, 11, carries_itself()), belt},
            {"rest_height", "A cube rests on the floor, and another on it, as closely as one sees.",
             "gap over the size", 1e-3, all_cases({.steps = steps_from_1_ms}, 17, carries_itself()),
             [](const PhysicsCase& c) {
                 return rest_height(c, {0, 0, 0});
             }},
            {"rest_far_from_origin", "The same 1,000 km away from the origin.", "gap over the size", 1e-3,
             all_cases(far_away, 3, carries_itself()),
             [](const PhysicsCase& c) {
                 return rest_height(c, {8e5, 6e5, 1e3});
             }},
            {"start_on_floor", "A cube that stands exactly on the floor at the start stays.",
             "way up over the size", 1e-3, all_cases({.far = FarBody::some}, 11, carries_itself()),
             start_on_floor}};
}

}  // namespace nbd
