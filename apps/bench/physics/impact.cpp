// Impacts: how long they last, what comes back, and how contact resists.
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "apps/bench/physics/physics_check.hpp"
#include "apps/bench/physics/physics_world.hpp"

namespace nbd {
namespace {

using Eigen::Vector3d;

constexpr double hit_speed = 0.01;       // of bars, by the speed of sound
constexpr int steps_of_an_impact = 100;  // of bars

/// A bar along x without Poisson's effect, of the case's size.
Solid bar(const PhysicsCase& c) {
    Material material = undamped_material(c);
    material.poisson = 0;
    return {brick(c.size * Vector3d(1, 0.1, 0.1), {40, 1, 1}), material};
}

/// Weightless and without friction.
WorldConfig bar_config() {
    WorldConfig config = weightless();
    config.contact.friction = 0;
    return config;
}

/// The step that divides an impact into steps_of_an_impact parts.
double bar_step(const PhysicsCase& c) { return 2 * c.size / speed_of_sound(c) / steps_of_an_impact; }

struct WallHit {
    double lasted = 0;  // by 2 L / c
    double left = 0;    // speed, by that before
};

WallHit hit_wall(const PhysicsCase& c) {
    const double dt = bar_step(c), speed = hit_speed * speed_of_sound(c);
    World world =
        world_of(c, bar_config(), {bar(c).at({0.501 * c.size, 0, 0}, {-speed, 0, 0})},
                 {{.shape = PlaneShape{.point = {0, 0, 0}, .normal = Vector3d::UnitX()}, .friction = 0}});
    const double most = world.elastic(0).mass() * speed;
    double first = -1, last = -1;
    // Until three times the impact and the way to the wall have passed.
    const int steps = 3 * steps_of_an_impact + 0.001 * c.size / (speed * dt);
    for (int s = 0; s < steps; ++s) {
        advance(world, dt);
        // A thousandth of the mean force is no more than a layer that one feels.
        if (contact_force(world, 0)[0] * steps_of_an_impact * dt < 1e-3 * most) continue;
        if (first < 0) first = world.time() - dt;
        last = world.time();
    }
    if (first < 0) throw std::runtime_error("the bar does not touch the wall");
    return {(last - first) / (steps_of_an_impact * dt), momentum(world, 0)[0] / most};
}

PhysicsOutcome exchange(const PhysicsCase& c) {
    const double dt = bar_step(c), speed = hit_speed * speed_of_sound(c);
    const Solid solid = bar(c);
    World world =
        world_of(c, bar_config(), {solid.at({0, 0, 0}, {speed, 0, 0}), solid.at({1.001 * c.size, 0, 0})});
    const double most = world.elastic(0).mass() * speed;
    for (int s = 0; s < 3 * steps_of_an_impact + 0.001 * c.size / (speed * dt); ++s) advance(world, dt);
    const double kept = momentum(world, 0)[0] / most, given = momentum(world, 1)[0] / most;
    return {.value = given, .truth = 1, .error = std::max(std::abs(kept), std::abs(given - 1))};
}

struct Rebound {
    double height = 0;  // by that of the drop
    double grown = 0;   // largest gain of energy, by that of the drop
};

/// A ball of the case's size in diameter drops by two and a half of it.
Rebound rebound(const PhysicsCase& c) {
    Material material = undamped_material(c);
    material.poisson = 0.3;
    const double drop = 2.5 * c.size;
    World world =
        world_of(c, config_of(), {Solid(ball(c.size / 2, 2), material).at({0, 0, drop + c.size / 2})},
                 {floor_plane(0)});
    const double fall = std::sqrt(2 * drop / standard_gravity),
                 whole = world.elastic(0).mass() * standard_gravity * drop;
    const double start = energy(world, 0, standard_gravity);  // a report's is also of the far body
    Rebound found;
    double highest = 0;
    bool has_hit = false;
    while (world.time() < 2.2 * fall) {
        advance(world, c.dt);
        has_hit = has_hit || contact_force(world, 0)[2] > 0;
        if (has_hit) highest = std::max(highest, mass_centre(world, 0)[2] - c.size / 2);
        found.grown = std::max(found.grown, (energy(world, 0, standard_gravity) - start) / whole);
    }
    if (!has_hit) throw std::runtime_error("the ball does not reach the floor");
    found.height = highest / drop;
    return found;
}

/// A ball between two plates, pressed by the case's parameter, the share of its radius at each.
PhysicsOutcome hertz(const PhysicsCase& c) {
    Material material = plain_material(c);
    material.poisson = 0.3;
    const double R = c.size / 2, depth = c.parameter * R;
    WorldConfig config = weightless();
    config.step.integrator = TimeIntegrator::backward_euler;
    World world(config);
    world.add_body(Solid(ball(R, 3, 1.7), material).at({0, 0, 0}));
    // Steps so long that the ball is at rest in each.
    const double dt = 20 * R / speed_of_sound(c), start = 1.01 * R;
    constexpr int steps = 40, more = 10;
    for (const int side : {-1, 1})
        world.add_obstacle(
            {.shape = PlaneShape{.point = {0, 0, side * start}, .normal = {0, 0, -1.0 * side}},
             .motion = travel({0, 0, -side * (start - R + depth) / (steps * dt)}, 0, steps * dt),
             .friction = 0});
    advance(world, dt, steps + more);
    // Of both plates: each pushes with half the sum of the sizes of the nodes' forces along z.
    const double force = world.contact_forces(0).col(2).cwiseAbs().sum() / 2;
    const double modulus = c.young / (1 - material.poisson * material.poisson);
    return relative_outcome(force, 4.0 / 3 * modulus * std::sqrt(R) * std::pow(depth, 1.5));
}

/// Cases whose step follows from the others.
std::vector<PhysicsCase> hitting_bars() {
    std::vector<PhysicsCase> cases = all_cases({.sizes = three_sizes, .steps = {0}}, 5);
    for (PhysicsCase& c : cases) c.dt = bar_step(c);
    return cases;
}

/// Balls of one ratio of weight to stiffness, with steps in proportion.
std::vector<PhysicsCase> falling_balls() {
    std::vector<PhysicsCase> cases =
        all_cases({.sizes = {0.02, 0.2, 2}, .steps = {1e-3, 2e-3}, .moduli = {0}}, 5);
    for (PhysicsCase& c : cases) {
        c.young = 1e6 * c.size / 0.2;
        c.dt *= std::sqrt(c.size / 0.2);
    }
    return cases;
}

}  // namespace

std::vector<PhysicsCheck> impact_checks() {
    const std::vector<PhysicsCase> bars = hitting_bars(), balls = falling_balls();
    std::vector<PhysicsCase> pressed = all_cases(
        {.sizes = {0.02, 0.2, 2}, .steps = {0}, .far = FarBody::none, .parameters = {0.01, 0.02}}, 11);
    for (PhysicsCase& c : pressed) c.dt = 20 * c.size / 2 / speed_of_sound(c);
    return {{"bar_wall_time",
             "A bar that hits a frictionless wall lengthwise touches it for 2 L / c, "
             "in 100 steps (waves in one dimension).",
             "time over 2 L / c", 0.03, bars,
             [](const PhysicsCase& c) { return relative_outcome(hit_wall(c).lasted, 1); }},
            {"bar_wall_speed", "It leaves the wall as fast as it came.", "speed over that before", 0.03, bars,
             [](const PhysicsCase& c) { return relative_outcome(hit_wall(c).left, 1); }},
            {"bars_exchange",
             "Of two equal bars in line, the one that comes stops, and the other goes on with its speed.",
             "speed given over that before", 0.03, bars, exchange},
            {"ball_rebound",
             "An undamped ball that drops by 2.5 diameters rebounds by more than 85 %: "
             "its contact lasts five transits of sound.",
             "height over that of the drop", 0.15, balls,
             [](const PhysicsCase& c) { return relative_outcome(rebound(c).height, 1); }},
            {"ball_energy", "Its energy never grows.", "energy gained, share of that of the drop", 1e-3,
             balls, [](const PhysicsCase& c) { return zero_outcome(rebound(c).grown); }},
            {"hertz", "A ball between two plates resists with 4/3 E* sqrt(R) d^1.5 (Hertz).", "force, N",
             0.03, pressed, hertz, "depth over the radius"}};
}

}  // namespace nbd
