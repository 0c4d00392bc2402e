// Loads, actuators and friction of parts.
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include "apps/bench/physics/physics_check.hpp"
#include "apps/bench/physics/physics_world.hpp"
#include "meshing/body/make_body.hpp"
#include "meshing/body/rigid_body.hpp"
#include "meshing/surface/quadratic_tets.hpp"
#include "meshing/surface/shells.hpp"
#include "meshing/surface/solid_boundary.hpp"

namespace nbd {
namespace {

using Eigen::Vector3d;

constexpr double plate_density = 200, air_density = 1.2;

/// Of a rigid plate an eighth as thick as it is long, whose coefficient of drag is the parameter.
double limit_of_fall(const PhysicsCase& c) {
    return std::sqrt(2 * plate_density * c.size / 8 * standard_gravity / (air_density * c.parameter));
}

PhysicsOutcome falls_in_air(const PhysicsCase& c) {
    const double limit = limit_of_fall(c), time = limit / standard_gravity;
    WorldBody plate = rigid_box(c.size * Vector3d(1, 1, 0.125), plate_density).at({0, 0, 0});
    plate.loads = {{.kind = LoadKind::wind, .air = {.density = air_density, .normal = c.parameter}}};
    World world = world_of(c, config_of(), {plate});
    while (world.time() < 2 * time) advance(world, c.dt);
    const double speed = -momentum(world, 0).z() / world.elastic(0).mass();
    return relative_outcome(speed, limit * std::tanh(world.time() / time));
}

Keyed<double> constant(double value) { return {{0.0}, {value}}; }

/// A rope from a hook under a movable pulley on a block, up again, and over a fixed pulley to another block.
/// parameter: mass of the first over that of the second. The acceleration of the first.
PhysicsOutcome pulleys(const PhysicsCase& c) {
    const double L = c.size;
    const Solid one = rigid_box(Vector3d::Constant(0.1 * L), 1000 * c.parameter),
                other = rigid_box(Vector3d::Constant(0.1 * L));
    World world = world_of(c, config_of(), {one.at({0, 0, 0}), other.at({L, 0, 0})});
    const auto cord = [&](int body, const Vector3d& from, const Vector3d& to) {
        CordJoint part{.from = from, .to = to};
        part.tension = constant(0);
        world.add_joint({.a = body, .b = -1, .kind = part});
    };
    cord(0, {0, 0, 0}, {-1e-6 * L, 0, L});
    cord(0, {0, 0, 0}, {1e-6 * L, 0, L});
    cord(1, {L, 0, 0}, {L, 0, L});
    world.add_tendon({.parts = {0, 1, 2}, .winch = constant(3 * L)});
    const double time = 0.3 * std::sqrt(L / standard_gravity);
    while (world.time() < time) advance(world, c.dt);
    const double m1 = one.elastic->mass(), m2 = other.elastic->mass();
    return relative_outcome(-momentum(world, 0).z() / m1 / world.time(),
                            standard_gravity * (m1 - 2 * m2) / (m1 + 4 * m2));
}

/// A flat rigid box whose middle row of vertices has a third of the friction of the others slides down a
/// slope. parameter: the mean of both, as contact weighs vertices.
PhysicsOutcome slides_on_two_frictions(const PhysicsCase& c) {
    constexpr double angle = 0.35;
    WorldConfig config = config_of();
    config.gravity = standard_gravity * Vector3d(std::sin(angle), 0, -std::cos(angle));
    const Solid box(make_rigid_body("box", box_surface(c.size * Vector3d(1, 1, 0.05), {16, 4, 1}), 1000));
    const Nodes& X = box.body.surface.X;
    const ContactShape shape(box.body.W, box.body.surface.F, box.body.tets.X);
    double base = 0, smooth = 0;  // weights
    for (int v = 0; v < X.rows(); ++v) {
        if (X(v, 2) > 0) continue;
        base += shape.rest_areas[v];
        if (std::abs(X(v, 1)) < 0.1 * c.size) smooth += shape.rest_areas[v];
    }
    const double share = smooth / base, rough_coefficient = c.parameter / (1 - share + share / 3);
    WorldBody body = box.at({0, 0, (0.025 + 1.0e-3 * 1.5) * c.size});
    for (const double y : X.col(1))
        body.friction.push_back(rough_coefficient / (std::abs(y) < 0.1 * c.size ? 3 : 1));
    World world = world_of(c, config, {body}, {floor_plane(c.parameter)});
    return relative_outcome(sliding_acceleration(c, world),
                            standard_gravity * (std::sin(angle) - c.parameter * std::cos(angle)));
}

/// How a body that nothing holds comes to rest: in long steps of Newton's iteration, in which sound crosses
/// it ten times.
WorldConfig settling() {
    WorldConfig config = weightless();
    config.step = {
        .integrator = TimeIntegrator::backward_euler, .newton_iterations = 20, .newton_tolerance = 1e-6};
    config.linear.tolerance = 1e-8;
    return config;
}

void settle(const PhysicsCase& c, World& world) { advance(world, 10 * c.size / speed_of_sound(c), 20); }

/// A block comes to rest with fibres that pull along it. parameter: their tension over Young's modulus.
PhysicsOutcome muscle_shortens(const PhysicsCase& c) {
    const Solid solid(elements_of(c, brick(c.size * Vector3d(1, 0.5, 0.25), {4, 2, 1})),
                      undamped_material(c));
    WorldBody body = solid.at({0, 0, 0});
    BodyLoad muscle{.kind = LoadKind::muscle, .tension = c.parameter * c.young};
    muscle.tets.resize(solid.elastic->element_count());
    std::iota(muscle.tets.begin(), muscle.tets.end(), 0);
    muscle.fibres.assign(muscle.tets.size(), Vector3d::UnitX());
    body.loads = {muscle};
    World world = world_of(c, settling(), {body});
    settle(c, world);
    const Eigen::Matrix3d F = world.elastic(0).deformation_gradient(world.state(0).x, 0);
    return relative_outcome(1 - F.col(0).norm(), c.parameter);
}

/// How much the cavity of a hollow ball widens under a pressure of a thousandth of Young's modulus.
/// parameter: its inner radius over the outer one.
PhysicsOutcome hollow_ball(const PhysicsCase& c) {
    const TriMesh outside = boundary_surface(ball(c.size, 2));
    TriMesh shell = outside;
    const int n = static_cast<int>(outside.X.rows());
    shell.X.conservativeResize(2 * n, 3);
    shell.X.bottomRows(n) = c.parameter * outside.X;
    shell.F.conservativeResize(2 * outside.F.rows(), 3);
    shell.F.bottomRows(outside.F.rows()) = outside.F.array() + n;
    const Solid solid(make_quadratic(filled(make_solid_boundary(shell).mesh)), undamped_material(c));
    WorldBody body = solid.at({0, 0, 0});
    const double p = 1e-3 * c.young;
    body.loads = {{.kind = LoadKind::pressure,
                   .pressure = p,
                   .faces = cavities_of(solid.body.surface.X, solid.body.surface.F).at(0).faces}};
    World world = world_of(c, settling(), {body});
    const double before = world.cavities().at(0).volume;
    settle(c, world);
    const double a = std::pow(c.parameter, 3), nu = solid.body.material.poisson,
                 widening = p * (a * (1 - 2 * nu) + (1 + nu) / 2) / (c.young * (1 - a));
    return relative_outcome(std::cbrt(world.cavities().at(0).volume / before) - 1, widening);
}

}  // namespace

std::vector<PhysicsCheck> load_checks() {
    const auto over = [](std::vector<double> parameters) {
        return PhysicsRange{.moduli = {1e5}, .parameters = std::move(parameters)};
    };
    PhysicsRange still = still_range;
    still.sizes = {0.01, 1, 100};
    still.steps = {0};  // as long as it takes
    still.moduli = {1e4, 1e9};
    still.parameters = {0.01, 0.05};
    PhysicsRange balls = still;
    balls.parameters = {0.5, 0.8};
    return {
        {"falls_in_air", "A plate falls at v tanh(g t / v), v^2 = 2 m g / (rho c A).", "speed, m/s", 0.01,
         all_cases(over({0.5, 2}), 9,
                   [](const PhysicsCase& c) {
                       const double time = limit_of_fall(c) / standard_gravity;
                       return c.dt < time / 100 && c.dt > time / 50'000;
                   }),
         falls_in_air, "coefficient of drag"},
        {"pulleys",
         "Of two blocks on a rope over a movable and a fixed pulley one falls with g (m1 - 2 m2) / (m1 + 4 m2).",
         "acceleration, m/s2", 0.01,
         all_cases(over({1, 4}), 7,
                   [](const PhysicsCase& c) {
                       const double time = std::sqrt(c.size / standard_gravity);
                       return c.dt < time / 30 && c.dt > time / 50'000;
                   }),
         pulleys, "ratio of their masses"},
        {"two_frictions", "A box whose base has two coefficients slides down a slope as by their mean.",
         "acceleration, m/s2", 0.01, all_cases(over({0.1, 0.25}), 9), slides_on_two_frictions,
         "mean coefficient of friction"},
        {"muscle_shortens", "A block of muscle comes to rest shorter by its tension over Young's modulus.",
         "strain", 0.01, with_quadratic(all_cases(still, 3)), muscle_shortens,
         "tension over Young's modulus"},
        {"hollow_ball", "Pressure widens the cavity of a ball as Lame's formula says.", "widening", 0.02,
         all_cases(balls, 3), hollow_ball, "inner radius over the outer one"}};
}

}  // namespace nbd
