// Bodies on obstacles that turn.
#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <vector>

#include "apps/bench/physics/physics_check.hpp"
#include "apps/bench/physics/physics_world.hpp"

namespace nbd {
namespace {

using Eigen::Vector3d;

constexpr double table_friction = 0.4;
/// Of the centre of a block that is 0.3 times as high as it is wide, by its width: where contact begins, so
/// that it does not hop.
constexpr double start_height = 0.15 + 1.0e-3 * 1.4457;

/// The rate at which friction is just enough for the share of what a body at this distance from the axis
/// needs, rad/s.
double table_rate(double arm, double share) {
    return std::sqrt(share * table_friction * standard_gravity / arm);
}

/// A flat block that turns with a plane about the z axis, `arm` from it.
World on_turntable(const PhysicsCase& c, double arm, double rate) {
    const Solid block(brick(c.size * Vector3d(1, 1, 0.3), {2, 2, 1}), plain_material(c));
    WorldBody body = block.at({arm, 0, start_height * c.size});
    for (Eigen::Index i = 0; i < body.state.x.rows(); ++i)
        body.state.v.row(i) = rate * Vector3d::UnitZ().cross(body.state.x.row(i).transpose()).transpose();
    Obstacle table = floor_plane(table_friction);
    constexpr double ever = 1e4;  // seconds
    table.motion.keyframes = {{.to_next = Interpolation::linear},
                              {.time = ever, .rotation = {0, 0, ever * rate}}};
    return world_of(c, config_of(), {body}, {table});
}

/// parameter: share of the friction that is needed. The error is that of the place a turn after it has come
/// down, by its distance from the axis.
PhysicsOutcome turntable(const PhysicsCase& c) {
    const double arm = 5 * c.size, rate = table_rate(arm, c.parameter), turn = 2 * std::numbers::pi / rate;
    World world = on_turntable(c, arm, rate);
    while (world.time() < 0.25 * turn) advance(world, c.dt);
    const Eigen::Vector2d before = mass_centre(world, 0).head<2>();
    const double start = world.time();
    while (world.time() < 1.25 * turn) advance(world, c.dt);
    const Eigen::Rotation2Dd turned(rate * (world.time() - start));
    return zero_outcome((mass_centre(world, 0).head<2>() - turned * before).norm() / arm);
}

/// How far from the axis a point comes that slides by Coulomb's law, by small steps.
double slid_from_axis(Eigen::Vector2d x, Eigen::Vector2d v, double rate, double time) {
    constexpr int steps = 200'000;
    const double dt = time / steps, most = table_friction * standard_gravity;
    for (int i = 0; i < steps; ++i) {
        v -= dt * most * (v - rate * Eigen::Vector2d(-x.y(), x.x())).normalized();
        x += dt * v;
    }
    return x.norm();
}

/// parameter: the same, above 1. Once the block slides, how far it comes from there.
PhysicsOutcome leaves_turntable(const PhysicsCase& c) {
    const double arm = 20 * c.size, rate = table_rate(arm, c.parameter), begin = 1 / rate, end = 3 / rate;
    World world = on_turntable(c, arm, rate);
    while (world.time() < begin) advance(world, c.dt);
    const Eigen::Vector2d x = mass_centre(world, 0).head<2>(),
                          v = momentum(world, 0).head<2>() / world.elastic(0).mass();
    const double start = world.time();
    while (world.time() < end) advance(world, c.dt);
    return relative_outcome(mass_centre(world, 0).head<2>().norm() - x.norm(),
                            slid_from_axis(x, v, rate, world.time() - start) - x.norm());
}

/// Seconds in which a plane tips, so slowly that inertia does not count.
double tipping_time(const PhysicsCase& c) { return 4 * std::sqrt(c.size); }

/// parameter: the angle of the plane, as a share of that at which a block slides. Way along the plane while
/// it tips and as long after that, by the size.
PhysicsOutcome tipping_plane(const PhysicsCase& c) {
    const double angle = std::atan(c.parameter * table_friction);
    const double time = tipping_time(c);
    Obstacle plane = floor_plane(table_friction);
    plane.motion = {.centre = {0, 0, -c.size}, .keyframes = {{}, {.time = time, .rotation = {0, angle, 0}}}};
    const Solid block(brick(c.size * Vector3d(1, 1, 0.3), {2, 2, 1}), plain_material(c));
    World world = world_of(c, config_of(), {block.at({0, 0, start_height * c.size})}, {plane});
    while (world.time() < 2 * time) advance(world, c.dt);
    const Vector3d place = plane.motion.at(world.time()).inverse(mass_centre(world, 0));
    return zero_outcome(place.head<2>().norm() / c.size);
}

}  // namespace

std::vector<PhysicsCheck> turning_checks() {
    const auto slowly = [](const PhysicsCase& c) {
        return carries_itself()(c) && c.dt < tipping_time(c) / 50;
    };
    // In a step, friction has the direction that the block's way has at its end.
    const auto sliding = [](const PhysicsCase& c) {
        return carries_itself()(c) && c.dt < 0.06 / table_rate(20 * c.size, c.parameter);
    };
    return {
        {"turntable", "A table takes a block along where omega^2 r < mu g: after a turn it is where it was.",
         "way beside its place, over the distance from the axis", 0.01,
         all_cases({.steps = steps_from_1_ms, .far = FarBody::some, .parameters = {0.5, 0.9}}, 11,
                   carries_itself()),
         turntable, "share of the friction that is needed"},
        {"leaves_turntable", "Where omega^2 r > mu g a block slides off as a point does (Coulomb).",
         "way from the axis, m", 0.03,
         all_cases({.steps = steps_from_1_ms, .far = FarBody::some, .parameters = {1.3}}, 11, sliding),
         leaves_turntable, "share of the friction that is needed"},
        {"tipping_plane", "A block stays on a plane that tips to less than the angle of friction.",
         "way along the plane over the size", 0.01,
         all_cases({.steps = steps_from_1_ms, .far = FarBody::some, .parameters = {0.9}}, 11, slowly),
         tipping_plane, "share of the tangent of the angle of friction"}};
}

}  // namespace nbd
