// Rigid bodies and joints.
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "apps/bench/physics/physics_check.hpp"
#include "apps/bench/physics/physics_world.hpp"
#include "meshing/body/rigid_body.hpp"
#include "sim/fem/momentum.hpp"

namespace nbd {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

Matrix3d cross_matrix(const Vector3d& w) {
    Matrix3d cross;
    cross << 0, -w.z(), w.y(), w.z(), 0, -w.x(), -w.y(), w.x(), 0;
    return cross;
}

/// The turn of two radians of a box, about an axis near that of its middle moment of inertia. parameter:
/// radians in a step. The error is that of its orientation, in radians.
PhysicsOutcome rigid_tumble(const PhysicsCase& c) {
    const Solid box = rigid_box(c.size * Vector3d(1, 0.6, 0.3));
    const double rate = c.parameter / c.dt;
    const Vector3d spin = rate * Vector3d(0.1, 1, 0.2);
    World world = world_of(c, weightless(), {box.at({0, 0, 0}, {0, 0, 0}, spin)});
    const Matrix3d inertia = rigid_inertia(*box.elastic, box.body.tets.X).bottomRightCorner<3, 3>();
    const Vector3d L = inertia * spin;
    Matrix3d R = Matrix3d::Identity();
    constexpr int parts = 50;
    const int steps = static_cast<int>(2 / c.parameter);
    for (int s = 0; s < steps; ++s) {
        advance(world, c.dt);
        for (int k = 0; k < parts; ++k) {
            const double h = c.dt / parts;
            const auto slope = [&](const Matrix3d& Q) -> Matrix3d {
                return cross_matrix(Q * inertia.inverse() * Q.transpose() * L) * Q;
            };
            const Matrix3d k1 = slope(R), k2 = slope(R + h / 2 * k1), k3 = slope(R + h / 2 * k2),
                           k4 = slope(R + h * k3);
            R += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
        }
    }
    const Matrix3d F = world.elastic(0).deformation_gradient(world.state(0).x, 0);
    return zero_outcome((F - R).norm());
}

/// parameter: coefficient of friction.
PhysicsOutcome rigid_slide(const PhysicsCase& c) {
    constexpr double angle = 0.35;
    WorldConfig config = config_of();
    config.gravity = standard_gravity * Vector3d(std::sin(angle), 0, -std::cos(angle));
    // Starts where contact begins, so that it does not hop.
    const Solid box = rigid_box(c.size * Vector3d(1, 1, 0.5));
    World world =
        world_of(c, config, {box.at({0, 0, (0.25 + 1.0e-3 * 1.5) * c.size})}, {floor_plane(c.parameter)});
    const double a = sliding_acceleration(c, world),
                 truth = standard_gravity * (std::sin(angle) - c.parameter * std::cos(angle));
    return relative_outcome(a, truth);
}

const std::string of_plate = "plate", of_needle = "needle", of_cube = "cube";

/// parameter: coefficient of friction.
PhysicsOutcome rigid_landing(const PhysicsCase& c) {
    const Solid box = rigid_box(c.size * (c.variant == of_plate    ? Vector3d(1, 0.7, 0.05)
                                          : c.variant == of_needle ? Vector3d(1, 0.05, 0.05)
                                                                   : Vector3d(1, 1, 1)));
    World world = world_of(
        c, config_of(),
        {box.at({0, 0, c.size}, {0, 0, 0}, std::sqrt(standard_gravity / c.size) * Vector3d(0.1, 0.2, 0.5),
                Eigen::AngleAxisd(1.9, Vector3d(1, 0.6, 0.2).normalized()).matrix())},
        {floor_plane(c.parameter)});
    advance(world, c.dt);
    const double first = energy(world, 0, standard_gravity), time = 10 * std::sqrt(c.size / standard_gravity);
    double most = first;
    while (world.time() < time) {
        advance(world, c.dt);
        most = std::max(most, energy(world, 0, standard_gravity));
    }
    return zero_outcome(most / first - 1);
}

constexpr double swing = 0.5;  // radians

const std::string given_inertia = "given inertia", on_rope = "on a rope", on_tendon = "on a tendon";

bool hangs(const PhysicsCase& c) { return c.variant == on_rope || c.variant == on_tendon; }
/// By the size: how far the centre of mass is from its joint, and the radius of gyration, none of what hangs
/// by its centre.
double depth_of(const PhysicsCase& c) {
    if (hangs(c)) return 1;
    return c.variant == given_inertia ? 0.2 : 0.5;
}
double gyration_of(const PhysicsCase& c) {
    if (hangs(c)) return 0;
    return c.variant == given_inertia ? 0.4 : std::sqrt((1 + 0.01) / 12);
}

double pendulum_period(const PhysicsCase& c) {
    const double d = depth_of(c), k = gyration_of(c);
    return 2 * std::numbers::pi * std::sqrt((d * d + k * k) * c.size / (d * standard_gravity)) *
           (1 + std::pow(swing, 2) / 16 + 11 * std::pow(swing, 4) / 3072);
}

Solid pendulum_bar(const PhysicsCase& c) {
    const Vector3d size = c.size * Vector3d(0.1, 0.1, 1);
    if (c.variant != given_inertia) return rigid_box(size);
    const double mass = 3, of = mass * std::pow(gyration_of(c) * c.size, 2);
    return Solid(make_rigid_body("bar", box_surface(size, {2, 2, 2}),
                                 {.mass = mass,
                                  .centre = Vector3d(0, 0, (0.5 - depth_of(c)) * c.size),
                                  .moments = Matrix3d(Vector3d(of, of, 0.02 * of).asDiagonal())}));
}

/// A cube whose centre hangs on a cord that does not stretch.
World hanging_world(const PhysicsCase& c) {
    const Solid cube = rigid_box(c.size * Vector3d(0.1, 0.1, 0.1));
    const Vector3d start = c.size * Vector3d(-std::sin(swing), 0, -std::cos(swing));
    World world = world_of(c, config_of(), {cube.at(start)});
    CordJoint cord{.from = start};
    cord.pulls_only = c.variant == on_rope;
    if (c.variant == on_tendon) cord.tension = {{0.0}, {0.0}};
    world.add_joint({.name = "cord", .kind = cord});
    if (c.variant == on_tendon) world.add_tendon({.parts = {0}, .winch = {{0.0}, {c.size}}});
    return world;
}

/// A bar on a ball joint at its end, or what hangs.
World pendulum_world(const PhysicsCase& c) {
    if (hangs(c)) return hanging_world(c);
    const Solid bar = pendulum_bar(c);
    const Matrix3d R = Eigen::AngleAxisd(swing, Vector3d::UnitY()).matrix();
    World world = world_of(c, config_of(), {bar.at(-R.col(2) * c.size / 2, {0, 0, 0}, {0, 0, 0}, R)});
    world.add_joint({.kind = BallJoint{}});
    return world;
}

PhysicsOutcome jointed_pendulum(const PhysicsCase& c) {
    World world = pendulum_world(c);
    double first = 0, last = 0, before = 0;
    for (int crossings = 0; crossings < 3;) {
        advance(world, c.dt);
        const double side = mass_centre(world, 0).x();
        if (before < 0 && side >= 0) {
            last = world.time() - c.dt * side / (side - before);
            if (crossings++ == 0) first = last;
        }
        before = side;
    }
    return relative_outcome((last - first) / 2, pendulum_period(c));
}

/// Of three swings.
PhysicsOutcome pendulum_energy(const PhysicsCase& c) {
    World world = pendulum_world(c);
    const double depth =
        world.elastic(0).mass() * standard_gravity * c.size * depth_of(c) * (1 - std::cos(swing));
    advance(world, c.dt);
    const double begin = energy(world, 0, standard_gravity);
    while (world.time() < 3 * pendulum_period(c)) advance(world, c.dt);
    return zero_outcome(std::abs(energy(world, 0, standard_gravity) - begin) / depth);
}

/// Eleven bodies on ball joints that swing down from a level line. parameter: mass of the last over that of
/// the others together. The error is the energy that it gains, by that of its fall.
PhysicsOutcome chain_energy(const PhysicsCase& c) {
    const Solid link = rigid_box(c.size * Vector3d(1, 0.2, 0.2)),
                last = rigid_box(c.size * Vector3d(1, 1, 1), c.parameter * 400);
    std::vector<WorldBody> bodies;
    for (int b = 0; b < 10; ++b) bodies.push_back(link.at({(0.5 + b) * c.size, 0, 0}));
    bodies.push_back(last.at({10.5 * c.size, 0, 0}));
    World world = world_of(c, config_of(), std::move(bodies));
    world.add_joint({.kind = BallJoint{}});
    for (int b = 0; b < 10; ++b)
        world.add_joint({.a = b, .b = b + 1, .kind = BallJoint{.point = {(b + 1) * c.size, 0, 0}}});
    const double fall = 10 * c.size * standard_gravity * (last.elastic->mass() + 5 * link.elastic->mass());
    double most = 0;
    while (world.time() < 3 * std::sqrt(10 * c.size / standard_gravity)) {
        advance(world, c.dt);
        double sum = 0;
        for (int b = 0; b <= 10; ++b) sum += energy(world, b, standard_gravity);
        most = std::max(most, sum);
    }
    return zero_outcome(most / fall);
}

/// Two bodies on a ball joint that turn about each other. The error is that of the angular momentum.
PhysicsOutcome joined_spin(const PhysicsCase& c) {
    const Solid heavy = rigid_box(c.size * Vector3d(1, 0.5, 0.5), 3000),
                light = rigid_box(c.size * Vector3d(1, 0.25, 0.25));
    const double rate = 0.02 / c.dt;
    World world = world_of(c, weightless(),
                           {heavy.at({0, 0, 0}, {0, 0, 0}, rate * Vector3d(0.25, 1, 0.5)),
                            light.at({c.size, 0, 0}, rate * c.size * Vector3d(0.02, 0.4, -0.3))});
    world.add_joint({.a = 0, .b = 1, .kind = BallJoint{.point = {c.size / 2, 0, 0}}});
    const Vector3d before = angular_momentum(world, 0) + angular_momentum(world, 1);
    advance(world, c.dt, 200);
    return zero_outcome((angular_momentum(world, 0) + angular_momentum(world, 1) - before).norm() /
                        before.norm());
}

}  // namespace

std::vector<PhysicsCheck> joined_checks() {
    const PhysicsRange range{.moduli = {1e5}};
    const auto with = [&](std::vector<double> parameters, FarBody far) {
        PhysicsRange of = range;
        of.parameters = std::move(parameters);
        of.far = far;
        return of;
    };
    PhysicsRange bars = range;
    bars.variants = {"", given_inertia, on_rope, on_tendon};
    PhysicsRange landings = with({0.3, 0.8}, FarBody::some);
    landings.variants = {of_plate, of_needle, of_cube};
    landings.steps = steps_from_1_ms;
    const auto resolved = [](const PhysicsCase& c) {
        return c.dt < pendulum_period(c) / 100 && c.dt > pendulum_period(c) / 20'000;
    };
    const auto links = [](const PhysicsCase& c) {
        const double time = std::sqrt(c.size / standard_gravity);
        return c.dt < 0.1 * time && c.dt > 1e-3 * time;
    };
    return {
        {"rigid_tumble", "A rigid box tumbles as Euler's equations say, for two radians.",
         "error of its orientation", 0.05, all_cases(with({0.01, 0.05}, FarBody::each), 7), rigid_tumble,
         "radians a step"},
        {"rigid_slide", "A rigid box slides down a slope of 0.35 rad with g (sin - mu cos).",
         "acceleration, m/s2", 0.01, all_cases(with({0.1, 0.3}, FarBody::each), 9), rigid_slide,
         "coefficient of friction"},
        {"rigid_landing",
         "A rigid plate, needle or cube that lands on a corner and tips over gains no energy.",
         "gain over the whole", 0.05, all_cases(landings, 9), rigid_landing, "coefficient of friction"},
        {"rigid_pendulum",
         "A rigid bar on a ball joint, or a body on a cord, swings by half a radian with the period of the "
         "elliptic integral.",
         "period, s", 0.005, all_cases(bars, 5, resolved), jointed_pendulum},
        {"rigid_pendulum_energy", "In three swings it keeps its energy.", "change, by that of a swing", 0.02,
         all_cases(bars, 5, resolved), pendulum_energy},
        {"chain_energy",
         "A chain of rigid links that swings down gains no energy, in steps below sqrt(L / g) / 10.",
         "gain, by the energy of its fall", 0.02, all_cases(with({1, 100}, FarBody::some), 5, links),
         chain_energy, "mass of the last over that of all others"},
        {"joined_spin", "Two bodies on a joint that turn about each other keep their angular momentum.",
         "change over the whole", 1e-3, all_cases(range, 5), joined_spin}};
}

}  // namespace nbd
