// Winds against closed forms.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "meshing/body/make_body.hpp"
#include "meshing/body/rigid_body.hpp"
#include "meshing/surface/quadratic_tets.hpp"
#include "sim/fem/momentum.hpp"
#include "sim/world/world.hpp"
#include "tests/meshing/shapes.hpp"
#include "tests/sim/support/momentum.hpp"
#include "tests/sim/world/box_model.hpp"
#include "tests/sim/world/same_bits.hpp"
#include "tests/support/box_mesh.hpp"
#include "tests/support/error_of.hpp"

namespace nbd {
namespace {

using Eigen::Vector3d;
using test::Model;

constexpr double g = 9.81;

enum class Kind { linear, quadratic, rigid };
constexpr Kind kinds[] = {Kind::linear, Kind::quadratic, Kind::rigid};

/// A square plate in the plane z = 0.
Model plate(Kind kind, double side, double thickness, double density, double young = 1e6) {
    const Vector3d size(side, side, thickness);
    const Material material{.young = young, .density = density, .rayleigh_mass = 0};
    if (kind == Kind::linear) return Model(size, {4, 4, 1}, material);
    if (kind == Kind::quadratic) {
        TetMesh mesh = make_quadratic(test::box_mesh(size, {2, 2, 1}));
        mesh.X.rowwise() -= 0.5 * size.transpose();
        return Model(make_body("plate", std::move(mesh), material), true);
    }
    TriMesh box = test::box(side, side, thickness, 2);
    box.X.rowwise() -= size.transpose() / 2;
    return Model(make_rigid_body("plate", std::move(box), density), true);
}

Model rigid_ball(double radius, double density) {
    TriMesh sphere = test::icosphere(3);
    sphere.X *= radius;
    return Model(make_rigid_body("ball", std::move(sphere), density), true);
}

BodyLoad wind(const AirFlow& air) { return {.kind = LoadKind::wind, .air = air}; }

World world_of(const Model& model, const AirFlow& air, const WorldConfig& config = {},
               const Vector3d& velocity = Vector3d::Zero()) {
    World world(config);
    WorldBody body = model.at({0, 0, 0}, Eigen::Matrix3d::Identity(), velocity);
    body.loads = {wind(air)};
    world.add_body(std::move(body));
    return world;
}

WorldConfig weightless(TimeIntegrator integrator = TimeIntegrator::second_order, int newton_iterations = 1) {
    return {.gravity = Vector3d::Zero(),
            .step = {.integrator = integrator, .newton_iterations = newton_iterations}};
}

double speed_down(const World& world) {
    return -test::linear_momentum(world, 0).z() / world.elastic(0).mass();
}

const Reaction& reaction_by(const std::vector<Reaction>& all, ReactionBy by) {
    const auto found = std::ranges::find(all, by, &Reaction::by);
    EXPECT_NE(found, all.end());
    return *found;
}

TEST(Wind, LetsAPlateFallAtTheSpeedAtWhichDragBearsItsWeight) {
    for (const Kind kind : kinds)
        for (const double side : {0.05, 0.4, 2.0}) {
            const double density = 200, thickness = side / 8, c = 1.3, air = 1.2,
                         terminal = std::sqrt(2 * density * thickness * g / (air * c)),
                         dt = terminal / g / 20;
            const Model model = plate(kind, side, thickness, density);
            World world = world_of(model, {.density = air, .normal = c});
            for (int step = 0; step < 120; ++step) {
                ASSERT_TRUE(test::is_balanced(world.step(dt))) << step;
                ASSERT_LT(speed_down(world), terminal * (1 + 1e-6));
            }
            // A soft plate bends and swings.
            const double loose = model.elastic->is_rigid() ? 1 : 5;
            EXPECT_NEAR(speed_down(world), terminal, loose * 1e-3 * terminal) << side;
            const std::vector<Reaction> reactions = world.reactions();
            ASSERT_EQ(reactions.size(), 1u);
            EXPECT_EQ(reactions[0].by, ReactionBy::wind);
            EXPECT_EQ(reactions[0].number, 0);
            const double weight = world.elastic(0).mass() * g;
            EXPECT_LT((reactions[0].force - weight * Vector3d::UnitZ()).norm(), loose * 2e-3 * weight);
        }
}

/// The front of a ball alone meets the air, so that its mean coefficient is half of that of a plate.
TEST(Wind, LetsABallFallByHalfOfItsCoefficient) {
    for (const double radius : {0.02, 0.3, 1.5}) {
        const Model model = rigid_ball(radius, 300);
        const double area = std::numbers::pi * radius * radius, mass = model.elastic->mass(), c = 0.94,
                     terminal = std::sqrt(2 * mass * g / (1.2 * c / 2 * area)), dt = terminal / g / 15;
        World world = world_of(model, {.normal = c});
        for (int step = 0; step < 90; ++step) ASSERT_TRUE(test::is_balanced(world.step(dt)));
        EXPECT_NEAR(speed_down(world), terminal, 0.01 * terminal) << radius;
        // Skin friction: the mean of sin^3 over a sphere's area is 3 pi / 16, and of its direction downward.
        World dragged = world_of(model, {.normal = 0, .tangential = c});
        const double of_skin = 1.2 / 2 * c * 4 * area * 3 * std::numbers::pi / 16,
                     slow = std::sqrt(mass * g / of_skin);
        for (int step = 0; step < 90; ++step) ASSERT_TRUE(test::is_balanced(dragged.step(slow / g / 15)));
        EXPECT_NEAR(speed_down(dragged), slow, 0.01 * slow) << radius;
    }
}

/// v = v_t tanh(g t / v_t). A wind acts as at the end of a step: to first order.
TEST(Wind, LetsSpeedApproachItsLimitAsTheHyperbolicTangent) {
    for (const TimeIntegrator rule : {TimeIntegrator::second_order, TimeIntegrator::backward_euler}) {
        const Model model = plate(Kind::rigid, 0.4, 0.05, 200);
        const double terminal = std::sqrt(2 * 200 * 0.05 * g / 1.2), time = terminal / g;
        std::vector<double> errors;
        for (const int steps : {20, 40, 80}) {
            World world = world_of(model, {}, {.step = {.integrator = rule}});
            for (int step = 0; step < steps; ++step) ASSERT_TRUE(test::is_balanced(world.step(time / steps)));
            errors.push_back(std::abs(speed_down(world) / terminal - std::tanh(1.0)));
        }
        EXPECT_LT(errors[2], 5e-3);
        for (const int k : {0, 1}) {
            EXPECT_GT(errors[k] / errors[k + 1], 1.7);
            EXPECT_LT(errors[k] / errors[k + 1], 2.4);
        }
    }
}

/// In steps five times as long as it takes to fall at the limit, and in newtons that count each other's work.
TEST(Wind, BringsALightPlateToItsLimitInLongStepsWithoutOscillation) {
    for (const Kind kind : kinds)
        for (const int newton : {1, 20}) {
            const double terminal = std::sqrt(2 * 5 * 0.05 * g / 1.2), dt = 5 * terminal / g;
            World world = world_of(plate(kind, 0.4, 0.05, 5, 1e5), {},
                                   {.step = {.newton_iterations = newton}}, {0, 0, 3 * terminal});
            double before = -3 * terminal;
            for (int step = 0; step < 6; ++step) {
                ASSERT_EQ(world.step(dt).failure, "");
                EXPECT_GT(speed_down(world), before - 1e-3 * terminal) << step;
                EXPECT_LT(speed_down(world), (kind == Kind::rigid ? 1.02 : 1.1) * terminal) << step;
                before = speed_down(world);
            }
            // In such steps a soft plate swings about the limit.
            EXPECT_NEAR(speed_down(world), terminal, (kind == Kind::rigid ? 0.01 : 0.1) * terminal);
        }
}

/// A soft block that spins, swings and flies through dense air at rest: kinetic and elastic energy only fall,
/// and winds are all that changes its momentum.
TEST(Wind, AtRestOnlyTakesEnergy) {
    for (const Kind kind : kinds)
        for (const double dt : {1e-3, 2e-2}) {
            const Model model = plate(kind, 0.4, 0.1, 300, 1e5);
            World world(weightless(TimeIntegrator::backward_euler));
            WorldBody body = model.at({0, 0, 0}, test::turned(0.6), {3, -1, 2});
            for (Eigen::Index i = 0; i < body.state.x.rows(); ++i) {
                const Vector3d x = body.state.x.row(i);
                body.state.v.row(i) += Vector3d(1, 4, 2).cross(x).transpose();
                if (kind != Kind::rigid) body.state.v.row(i) += 5 * x.cwiseProduct(x.reverse()).transpose();
            }
            body.loads = {wind({.density = 60, .normal = 1.5, .tangential = 0.3})};
            world.add_body(std::move(body));
            double energy = kinetic_energy(world.elastic(0), world.state(0).v);
            const double begin = energy;
            for (int step = 0; step < 60; ++step) {
                const Vector3d before = test::linear_momentum(world, 0);
                const WorldReport report = world.step(dt);
                ASSERT_EQ(report.failure, "");
                const double now = report.kinetic_energy + report.elastic_energy;
                EXPECT_LE(now, energy + 1e-9 * begin) << step;
                energy = now;
                const Vector3d gain = test::linear_momentum(world, 0) - before,
                               told = dt * reaction_by(world.reactions(), ReactionBy::wind).force;
                EXPECT_LT((gain - told).norm(), 1e-6 * before.norm());
            }
            EXPECT_LT(energy, (dt > 0.01 ? 0.1 : 0.7) * begin);
        }
}

TEST(Wind, CarriesABodyAlongAtItsOwnSpeed) {
    for (const Kind kind : kinds) {
        const AirFlow air{.keys = {{0, 1}, {Vector3d(0, 0, 0), Vector3d(4, -2, 1)}},
                          .density = 1000,
                          .normal = 1,
                          .tangential = 1};
        World world = world_of(plate(kind, 0.2, 0.05, 200, 1e6), air, weightless());
        ASSERT_EQ(world.step(0.01).failure, "");
        EXPECT_LT(test::linear_momentum(world, 0).norm() / world.elastic(0).mass(), 0.05);
        while (world.time() < 6) ASSERT_EQ(world.step(0.02).failure, "");
        const Vector3d v = test::linear_momentum(world, 0) / world.elastic(0).mass();
        EXPECT_LT((v - air.keys.values[1]).norm(), 0.05 * v.norm());
    }
}

/// A plate held at its back bears 1/2 rho c A v^2, in motion that has come to rest and in statics, where the
/// load grows evenly.
TEST(Wind, PressesOnWhatIsHeld) {
    for (const Kind kind : kinds)
        for (const bool is_static : {false, true})
            for (const double speed : {3.0, 20.0}) {
                const Model model = plate(kind, 0.4, 0.05, 200, 1e6);
                WorldConfig config = weightless(TimeIntegrator::backward_euler);
                if (is_static) config.statics.emplace();
                World world(config);
                WorldBody body = model.at({0, 0, 0});
                Grip grip;
                for (int i = 0; i < body.state.x.rows(); ++i)
                    if (kind == Kind::rigid || body.state.x(i, 2) < -0.02) grip.nodes.push_back(i);
                body.grips = {grip};
                body.loads = {wind({.velocity = {0, 0, -speed}, .normal = 1.1})};
                world.add_body(std::move(body));
                const double force = 1.2 / 2 * 1.1 * 0.16 * speed * speed;
                for (int k = 1; k <= 5; ++k) {
                    const WorldReport report = world.step(is_static ? 0.2 : 1.0);
                    ASSERT_EQ(report.failure, "");
                    if (!is_static) continue;
                    const Vector3d now = reaction_by(world.reactions(), ReactionBy::grip).force;
                    EXPECT_LT((now - 0.2 * k * force * Vector3d::UnitZ()).norm(), 2e-3 * force);
                }
                const std::vector<Reaction> reactions = world.reactions();
                const Vector3d held = reaction_by(reactions, ReactionBy::grip).force,
                               blown = reaction_by(reactions, ReactionBy::wind).force;
                EXPECT_LT((held - force * Vector3d::UnitZ()).norm(), 2e-3 * force) << speed;
                EXPECT_LT((held + blown).norm(), 1e-5 * force);
            }
}

TEST(Wind, GivesTheSameBitsOnAnyNumberOfThreadsAndFromASnapshot) {
    const Model model = plate(Kind::linear, 0.4, 0.1, 100, 1e5);
    const auto made = [&] {
        World world(WorldConfig{});
        WorldBody body = model.at({0, 0, 0}, test::turned(0.4));
        body.loads = {wind({.velocity = {5, 2, 0}, .tangential = 0.2})};
        world.add_body(std::move(body));
        return world;
    };
    test::expect_same_bits(made, 20);
}

TEST(Wind, RefusesWhatHasNoMeaning) {
    const Model model = plate(Kind::linear, 0.4, 0.1, 100);
    const auto error = [&](const BodyLoad& load) {
        World world(WorldConfig{});
        WorldBody body = model.at({0, 0, 0});
        body.loads = {load};
        return test::error_of<std::invalid_argument>([&] { world.add_body(std::move(body)); });
    };
    EXPECT_EQ(error(wind({.density = -1})), "load: a wind needs a density and coefficients >= 0");
    EXPECT_EQ(error(wind({.normal = NAN})), "load: a wind needs a density and coefficients >= 0");
    EXPECT_EQ(error(wind({.tangential = -0.1})), "load: a wind needs a density and coefficients >= 0");
    EXPECT_EQ(error(wind({.keys = {{1, 1}, {Vector3d::Zero(), Vector3d::Zero()}}})),
              "load: a wind needs finite velocities at times that increase");
    BodyLoad load = wind({});
    load.faces = {1 << 20};
    EXPECT_NE(error(load).find("face 1048576 is not in 0.."), std::string::npos);
}

}  // namespace
}  // namespace nbd
