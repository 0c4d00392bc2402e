// Coulomb's friction on a plane and on a body, in motion.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "apps/bench/physics/physics_check.hpp"
#include "apps/bench/physics/physics_world.hpp"

namespace nbd {
namespace {

/// Impulses of a landing, relative to what is allowed.
struct Landing {
    double sum = 0;    // friction over the coefficient times the normal impulse, of the steps that slide
    double worst = 0;  // the largest of a step, of all steps
};

/// Adds up the contact forces on a body that slides along x.
class SlidingImpulses {
 public:
    /// rounding: normal impulses below this are no contact, N s.
    SlidingImpulses(const World& world, double friction, double rounding)
        : world_(world), friction_(friction), rounding_(rounding) {
        const Nodes& X = world.elastic(0).rest().X;
        const double low = X.col(2).minCoeff();
        sole_ = nodes_at(X, [&](const Eigen::Vector3d& p) { return p[2] < 0.9 * low; });
    }

    /// Call it after a step.
    void add(double dt) {
        const Eigen::Vector3d impulse = dt * contact_force(world_, 0);
        if (impulse[2] < rounding_) return;
        worst_ = std::max(worst_, impulse.head<2>().norm() / (friction_ * impulse[2]));
        constexpr double slow = 0.05;  // m/s: below it a point may stick
        if (world_.state(0).v(sole_, 0).minCoeff() < slow) return;
        normal_ += impulse[2];
        along_ -= impulse[0];
    }

    /// Throws std::runtime_error where the normal impulse stays below `least`.
    Landing result(double least) const {
        if (normal_ < least) throw std::runtime_error("it was not stopped: too small an impulse");
        return {along_ / (friction_ * normal_), worst_};
    }

 private:
    const World& world_;
    double friction_, rounding_;
    std::vector<int> sole_;
    double normal_ = 0, along_ = 0, worst_ = 0;
};

/// A slab that does not tip when it lands.
Solid slab(const PhysicsCase& c) {
    return {brick(c.size * Eigen::Vector3d(1, 1, 0.3), {3, 3, 1}), plain_material(c)};
}

/// A slab comes down while it moves along the floor at 3 m/s, and slides on.
Landing land(const PhysicsCase& c) {
    const double along = 3, sound = speed_of_sound(c);
    // An impact at more than a tenth of the speed of sound crushes the slab.
    const double drop = std::min(0.1, std::pow(0.1 * sound, 2) / (2 * standard_gravity));
    World world = world_of(c, config_of(), {slab(c).at({0, 0, 0.15 * c.size + drop}, {along, 0, 0})},
                           {floor_plane(c.parameter)});
    const double fall = std::sqrt(2 * drop / standard_gravity),
                 weight = standard_gravity * world.elastic(0).mass();
    SlidingImpulses impulses(world, c.parameter, 0.01 * weight * c.dt);
    while (world.time() < fall + 0.15 + 2 * c.size / sound) {
        advance(world, c.dt);
        impulses.add(c.dt);
    }
    return impulses.result(0.5 * weight * fall);
}

/// The same on a plate that is a body, whose lower side is held.
Landing land_on_body(const PhysicsCase& c) {
    const double speed = std::min({0.05 * speed_of_sound(c), 1.0, 0.1 * c.size / c.dt});
    WorldConfig config = weightless();
    config.contact.friction = c.parameter;
    const Solid plate(brick(c.size * Eigen::Vector3d(5, 3, 0.5), {10, 6, 1}), plain_material(c));
    WorldBody held = plate.at({0, 0, -0.25 * c.size});
    held.grips = {{.nodes = nodes_at(plate.body.tets.X, [](const Eigen::Vector3d& p) { return p[2] < 0; })}};
    World world =
        world_of(c, config, {slab(c).at({-c.size, 0, 0.18 * c.size}, {3 * speed, 0, -speed}), held});
    const double mass = world.elastic(0).mass();
    SlidingImpulses impulses(world, c.parameter, 1e-3 * mass * speed);
    for (double way = 0; way < 0.3 * c.size; way += speed * c.dt) {
        advance(world, c.dt);
        impulses.add(c.dt);
    }
    return impulses.result(0.5 * mass * speed);
}

PhysicsOutcome excess(double ratio) {
    return {.value = ratio, .truth = 1, .error = std::max(0.0, ratio - 1)};
}

constexpr double slope = 20 * std::numbers::pi / 180;

/// A world in which a cube stands on a slope that falls along x.
World world_on_slope(const PhysicsCase& c, double friction) {
    WorldConfig config = config_of();
    config.gravity = standard_gravity * Eigen::Vector3d(std::sin(slope), 0, -std::cos(slope));
    return world_of(c, config, {Solid(cube(c), plain_material(c)).at({0, 0, 0.502 * c.size})},
                    {floor_plane(friction)});
}

PhysicsOutcome slide(const PhysicsCase& c) {
    World world = world_on_slope(c, c.parameter);
    double t = 0;
    for (; t < 0.5; t += c.dt) advance(world, c.dt);
    const Eigen::Vector3d before = momentum(world, 0);
    const double start = t, mass = world.elastic(0).mass();
    for (; t < 1.5; t += c.dt) advance(world, c.dt);
    const Eigen::Vector3d gained = (momentum(world, 0) - before) / (mass * (t - start));
    // What still moves up or down changes the force on the slope.
    const double normal = standard_gravity * std::cos(slope) + gained[2];
    return relative_outcome(gained[0], standard_gravity * std::sin(slope) - c.parameter * normal);
}

/// parameter: of the coefficient at which the cube begins to slide, what is needed.
PhysicsOutcome stand(const PhysicsCase& c) {
    World world = world_on_slope(c, std::tan(slope) / c.parameter);
    constexpr double settled = 2, minute = 60;
    const double end = c.dt < 5e-3 ? 4 : minute;
    double t = 0;
    for (; t < settled; t += c.dt) advance(world, c.dt);
    const Eigen::Vector3d before = mass_centre(world, 0);
    const double start = t;
    for (; t < end; t += c.dt) advance(world, c.dt);
    const double way = (mass_centre(world, 0) - before).head<2>().norm() * minute / (t - start);
    return zero_outcome(way);
}

}  // namespace

std::vector<PhysicsCheck> friction_checks() {
    const auto cases = [](int thinning, std::vector<double> parameters) {
        return all_cases(
            {.steps = steps_from_1_ms, .far = FarBody::some, .parameters = std::move(parameters)}, thinning,
            carries_itself());
    };
    const std::vector<PhysicsCase> landings =
        all_cases({.far = FarBody::some, .parameters = {0.1, 0.3}}, 13, carries_itself());
    return {{"landing",
             "A slab that lands while it slides loses the coefficient times the normal impulse (Coulomb).",
             "friction over coefficient times normal impulse", 0.01, landings,
             [](const PhysicsCase& c) { return relative_outcome(land(c).sum, 1); }, "coefficient"},
            {"landing_each_step", "In no step does friction exceed the coefficient times the normal force.",
             "friction over coefficient times normal force, largest of a step", 0.01, landings,
             [](const PhysicsCase& c) { return excess(land(c).worst); }, "coefficient"},
            {"landing_on_body",
             "The same of a slab that hits a plate obliquely, a body whose lower side is held.",
             "friction over coefficient times normal impulse", 0.01,
             all_cases({.sizes = three_sizes, .far = FarBody::some, .parameters = {0.1, 0.3}}, 13),
             [](const PhysicsCase& c) { return relative_outcome(land_on_body(c).sum, 1); }, "coefficient"},
            {"slope", "A cube slides down a slope of 20 degrees with g (sin - mu cos).", "acceleration, m/s2",
             0.01, cases(37, {0.1, 0.3, 0.35, 0.36}), slide, "coefficient"},
            {"stands_on_slope", "Below the limit it stands for a minute.", "way in a minute, m", 1e-5,
             cases(29, {0.5, 0.9}), stand, "share of the limit"}};
}

}  // namespace nbd
