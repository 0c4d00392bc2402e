// Ropes, tendons and limits that have a length, against closed forms.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "meshing/body/make_body.hpp"
#include "meshing/body/rigid_body.hpp"
#include "sim/fem/momentum.hpp"
#include "sim/world/world.hpp"
#include "tests/meshing/shapes.hpp"
#include "tests/sim/support/momentum.hpp"
#include "tests/sim/world/box_model.hpp"
#include "tests/sim/world/cords.hpp"
#include "tests/support/error_of.hpp"

namespace nbd {
namespace {

using Eigen::Vector3d;
using test::constant;
using test::Model;
using test::pulled;
using test::rigid_block;
using test::without_gravity;

/// A rope that does not stretch winds a block up at a constant speed, in small and large steps, and bears its
/// weight; a spring at the winch is longer by that.
TEST(Winch, LiftsABlockByTheLengthThatItTakesIn) {
    for (const double dt : {2e-3, 1e-2})
        for (const double stiffness : {0.0, 400.0}) {
            const Model model = rigid_block({0.1, 0.1, 0.1});  // 1 kg
            World world(WorldConfig{});
            world.add_body(model.at({0, 0, 0}));
            CordJoint cord{.from = {0, 0, 0.05}, .to = {0, 0, 1.05}, .stiffness = stiffness};
            cord.winch = {{0.5, 2.5}, {1, 0.4}};
            cord.pulls_only = true;
            cord.damping = stiffness > 0 ? 30 : 0;
            world.add_joint({.name = "rope", .a = 0, .b = -1, .kind = cord});
            double pulled = 0;
            const auto run_to = [&](double time) {
                double sum = 0;
                int steps = 0;
                while (world.time() < time - dt / 2) {
                    ASSERT_EQ(world.step(dt).failure, "");
                    for (const Reaction& reaction : world.reactions())
                        if (reaction.by == ReactionBy::joint) sum += reaction.force.z();
                    ++steps;
                }
                pulled = sum / steps;
            };
            run_to(1.5);
            const double sag = stiffness > 0 ? 9.81 / stiffness : 0;
            const double drag =
                cord.damping * 0.3 / std::max(stiffness, 1.0);  // over its stiffness, while it moves
            EXPECT_NEAR(world.joint_value(0), 0.7 + sag + drag, 2e-3) << dt;
            run_to(2.3);
            EXPECT_NEAR(world.joint_value(0), 0.46 + sag + drag, 2e-3) << dt;
            EXPECT_NEAR(pulled, 9.81, 0.02 * 9.81) << "it goes up evenly";
            run_to(6);
            EXPECT_NEAR(world.joint_value(0), 0.4 + sag, 1e-3) << dt;
            world.set_joint(0, 0.6);
            run_to(9);
            EXPECT_NEAR(world.joint_value(0), 0.6 + sag, 1e-3) << dt;
        }
}

/// Blocks that hang below each other on tendons stay at rest, the lower ones lighter or heavier.
TEST(Winch, TendonsInSeriesHoldWhatHangsOnThem) {
    for (const double dt : {5e-3, 2e-2})
        for (const double ratio : {0.01, 1.0, 10.0, 100.0}) {
            const Model upper = rigid_block({0.2, 0.2, 0.2}),
                        lower = rigid_block(0.2 * std::cbrt(ratio) * Vector3d::Ones());
            World world(WorldConfig{});
            Vector3d hook(0, 0, 0);
            double weights = 0;
            for (int k = 0; k < 2; ++k) {
                const Vector3d at(0, 0, -1.0 - 3 * k);
                const int body = world.add_body((k == 0 ? upper : lower).at(at));
                const int rope = world.add_joint(
                    {.a = body, .b = body - 1, .kind = pulled(at, hook, constant(0)), .bodies_meet = true});
                world.add_tendon({.parts = {rope}, .winch = constant((at - hook).norm())});
                hook = at;
                weights += 9.81 * world.elastic(body).mass();
            }
            for (int s = 0; s < 400; ++s) {
                const WorldReport report = world.step(dt);
                ASSERT_EQ(report.trouble, StepTrouble::none) << report.trouble_reason;
                ASSERT_LT(report.kinetic_energy, 1e-4 * weights) << ratio << ' ' << dt << ' ' << s;
            }
            EXPECT_LT(world.state(1).v.norm(), 1e-2);
        }
}

/// A rope that does not stretch, or a tendon, takes up what it catches without a rebound: at the speed of its
/// winch from rest, and a block that falls into it stops.
TEST(Winch, TakesUpWhatItCatchesWithoutARebound) {
    for (const auto& [size, dt] :
         {std::pair(0.002, 1e-3), std::pair(0.1, 1e-3), std::pair(0.1, 2e-2), std::pair(5.0, 2e-2)})
        for (const bool is_tendon : {false, true}) {
            const Model model = rigid_block({size, size, size});
            const double speed = size / 0.1;
            const Keyed<double> winch{{0, 1}, {20 * size, 20 * size - speed}};
            const auto bound = [&](World& world, const Keyed<double>& lengths) {
                CordJoint cord{.from = {0, 0, 0}, .to = {0, 0, 20 * size}};
                if (is_tendon)
                    cord.tension = constant(0);
                else
                    cord.winch = lengths;
                cord.pulls_only = !is_tendon;
                world.add_joint({.name = "rope", .a = 0, .b = -1, .kind = cord});
                if (is_tendon) world.add_tendon({.parts = {0}, .winch = lengths});
            };
            World world(without_gravity());
            world.add_body(model.at({0, 0, 0}));
            bound(world, winch);
            for (int step = 0; step < 30; ++step) {
                ASSERT_EQ(world.step(dt).failure, "");
                const double v = test::linear_momentum(world, 0).z() / model.elastic->mass();
                ASSERT_NEAR(v, speed, 0.01 * speed) << size << ' ' << dt << ' ' << is_tendon << ' ' << step;
            }
            World falls(without_gravity());
            WorldBody body = model.at({0, 0, 0}, Eigen::Matrix3d::Identity(), Vector3d(0, 0, -speed));
            falls.add_body(body);
            bound(falls, constant(20 * size + 2.5 * speed * dt));
            for (int step = 0; step < 30; ++step) {
                ASSERT_EQ(falls.step(dt).failure, "");
                const double v = test::linear_momentum(falls, 0).z() / model.elastic->mass();
                if (step > 3) {
                    ASSERT_NEAR(v, 0, 0.01 * speed) << size << ' ' << dt << ' ' << is_tendon << ' ' << step;
                }
            }
        }
}

/// So do the limits of sliders and hinges: what runs into them stops there.
TEST(Winch, LimitsStopWhatRunsIntoThem) {
    for (const auto& [size, dt] : {std::pair(0.002, 1e-3), std::pair(0.1, 2e-2), std::pair(5.0, 2e-2)})
        for (const double steps : {2.05, 2.4, 2.6, 2.95})
            for (const bool is_hinge : {false, true}) {
                const Model model = rigid_block({size, size, size});
                World world(without_gravity());
                const double rate = is_hinge ? 0.05 / dt : 0.05 * size / dt;  // rad/s or m/s
                WorldBody body = model.at({0, 0, 0});
                if (is_hinge)
                    for (Eigen::Index i = 0; i < body.state.v.rows(); ++i)
                        body.state.v.row(i) = rate * Vector3d::UnitZ().cross(Vector3d(body.state.x.row(i)));
                else
                    body.state.v.col(0).setConstant(rate);
                world.add_body(std::move(body));
                const JointFreedom freedom{.least = is_hinge ? -1 : -size, .most = steps * dt * rate};
                if (is_hinge)
                    world.add_joint({.name = "j", .kind = HingeJoint{.axis = {0, 0, 1}, .angle = freedom}});
                else
                    world.add_joint({.name = "j", .kind = SliderJoint{.axis = {1, 0, 0}, .way = freedom}});
                const auto energy = [&] {
                    return kinetic_energy(world.elastic(0), world.snapshot().bodies[0].v);
                };
                const double first = energy();
                for (int step = 0; step < 12; ++step) ASSERT_EQ(world.step(dt).failure, "");
                EXPECT_LT(energy(), 1e-3 * first) << size << ' ' << steps << ' ' << is_hinge;
            }
}

TEST(Winch, RefusesLengthsThatHaveNoMeaning) {
    const Model model = rigid_block({0.1, 0.1, 0.1});
    const auto error = [&](const CordJoint& cord) {
        World world(without_gravity());
        world.add_body(model.at({0, 0, 0}));
        return test::error_of<std::invalid_argument>([&] { world.add_joint({.name = "w", .kind = cord}); });
    };
    CordJoint cord{.from = {0, 0, 0}, .to = {1, 0, 0}};
    cord.winch = {{0, 1}, {1, 0}};
    EXPECT_EQ(error(cord), "joint \"w\": the lengths of its winch must be > 0");
    cord.winch = {{1, 1}, {1, 2}};
    EXPECT_EQ(error(cord), "joint \"w\": the times of its winch must ascend");
    cord.winch = constant(1);
    cord.length = 2;
    EXPECT_EQ(error(cord), "joint \"w\": a winch leaves nothing to its length");
}

/// A pulley: a cord from the world over a point of a block back to the world and down to another block. With
/// a given length they balance like weights on a movable pulley: twice the tension on the first, once on the
/// second, a = g (m1 - 2 m2) / (m1 + 4 m2) of the first downward (Atwood).
TEST(Winch, LetsOneTensionRunAlongATendonAsAPulleyDoes) {
    for (const double dt : {1e-3, 5e-3})
        for (const double ratio : {1.0, 3.0}) {
            const Model one = rigid_block({0.1, 0.1, 0.1}), other = rigid_block({0.1, 0.1, 0.1 * ratio});
            World world(WorldConfig{});
            world.add_body(one.at({0, 0, 0}));
            world.add_body(other.at({1, 0, 0}));
            const double m1 = world.elastic(0).mass(), m2 = world.elastic(1).mass();
            const Vector3d left(-1e-6, 0, 1), right(1e-6, 0, 1), over(1, 0, 1);
            world.add_joint({.name = "1", .a = 0, .b = -1, .kind = pulled({0, 0, 0}, left, constant(0))});
            world.add_joint({.name = "2", .a = 0, .b = -1, .kind = pulled({0, 0, 0}, right, constant(0))});
            world.add_joint({.name = "3", .a = 1, .b = -1, .kind = pulled({1, 0, 0}, over, constant(0))});
            world.add_tendon({.parts = {0, 1, 2}, .fixed = 0.5, .winch = constant(3.5)});
            WorldReport report;
            while (world.time() < 0.3 - dt / 2) ASSERT_EQ((report = world.step(dt)).failure, "");
            const double a = 9.81 * (m1 - 2 * m2) / (m1 + 4 * m2);
            const double way = -test::centre_of_mass(world, 0).z();
            EXPECT_NEAR(way, a * 0.045, 0.02 * std::abs(a) * 0.045 + 1.5 * std::abs(a) * 0.3 * dt) << ratio;
            EXPECT_NEAR(test::centre_of_mass(world, 1).z(), 2 * way, 2e-3 * std::abs(way)) << ratio;
            for (const Reaction& reaction : world.reactions()) {
                ASSERT_EQ(reaction.by, ReactionBy::joint);
                EXPECT_NEAR(reaction.force.norm(), m2 * (9.81 + 2 * a), 0.01 * m2 * 9.81) << ratio;
            }
        }
}

/// A tendon along a soft block shortens it by what the winch takes in and the stiffness leaves.
TEST(Winch, ContractsASoftBlockByAGivenLength) {
    for (const double stiffness : {0.0, 2e3}) {
        const Vector3d size(0.4, 0.1, 0.1);
        const Model model(size, {8, 2, 2}, {.young = 1e5, .poisson = 0.3, .rayleigh_mass = 0});
        World world(without_gravity(TimeIntegrator::backward_euler));
        world.add_body(model.at({0, 0, 0}));
        const Vector3d way[] = {{-0.19, 0, 0}, {0, 0, 0}, {0.19, 0, 0}};
        for (const int k : {0, 1})
            world.add_joint({.name = "t", .a = 0, .b = 0, .kind = pulled(way[k], way[k + 1], constant(0))});
        world.add_tendon({.parts = {0, 1}, .winch = {{0, 0.5}, {0.38, 0.37}}, .stiffness = stiffness});
        for (int step = 0; step < 60; ++step) ASSERT_EQ(world.step(0.05).failure, "");
        const double length = world.joint_value(0) + world.joint_value(1);
        double tension = 0;
        for (const Reaction& reaction : world.reactions())
            if (reaction.number == 0) tension = std::max(tension, reaction.force.norm());
        if (stiffness == 0)
            EXPECT_NEAR(length, 0.37, 1e-4);
        else
            EXPECT_GT(length, 0.371);
        EXPECT_LT(test::linear_momentum(world, 0).norm(), 1e-9);
    }
}

TEST(Winch, OfATendonRefusesWhatHasNoMeaning) {
    const Model model = rigid_block({0.1, 0.1, 0.1});
    const auto error = [&](const Tendon& tendon) {
        World world(without_gravity());
        world.add_body(model.at({0, 0, 0}));
        world.add_joint({.name = "ball", .a = 0, .b = -1, .kind = BallJoint{}});
        world.add_joint({.name = "part", .a = 0, .b = -1, .kind = pulled({0, 0, 0}, {1, 0, 0}, constant(0))});
        return test::error_of<std::invalid_argument>([&] { world.add_tendon(tendon); });
    };
    EXPECT_EQ(error({.parts = {}, .winch = constant(1)}), "tendon: it has no parts");
    EXPECT_EQ(error({.parts = {2}, .winch = constant(1)}), "tendon: joint 2 is not one of 2");
    EXPECT_EQ(error({.parts = {0}, .winch = constant(1)}),
              "tendon: joint \"ball\" is no cord with a given tension of its own");
    EXPECT_EQ(error({.parts = {1}, .winch = constant(0)}),
              "tendon: its winch needs lengths > 0 at times that increase");
    EXPECT_EQ(error({.parts = {1}, .winch = {}}),
              "tendon: its winch needs lengths > 0 at times that increase");
    EXPECT_EQ(error({.parts = {1}, .winch = constant(1), .stiffness = -1}),
              "tendon: it needs a stiffness >= 0");
    EXPECT_EQ(error({.parts = {1}, .winch = constant(1)}), "");
}

/// A rope that is told to stretch does what it was told, by more than what joints may give.
TEST(Rope, ThatStretchesIsNoBrokenJoint) {
    const Model block = rigid_block({0.1, 0.1, 0.1});
    World world({.gravity = {0, 0, -9.81}});
    world.add_body(block.at({0, 0, 0}));
    CordJoint rope{.from = {0, 0, 0}, .to = {0, 0, 1}, .stiffness = 100};
    rope.pulls_only = true;
    rope.damping = 10;
    world.add_joint({.name = "rope", .kind = rope});
    for (int step = 0; step < 400; ++step) {
        const WorldReport report = world.step(5e-3);
        ASSERT_EQ(report.failure, "");
        ASSERT_EQ(report.trouble, StepTrouble::none) << report.trouble_reason;
    }
    EXPECT_NEAR(world.joint_value(0), 1 + 9.81 / 100, 1e-3);
}

/// Nor does one that turns its body: the step is of backward Euler where that turns far.
TEST(Rope, OffTheCentreOfWhatSwingsOnItMakesNoEnergy) {
    const Model block = rigid_block({0.1, 0.1, 0.1});
    for (const bool is_tendon : {false, true})
        for (const double dt : {0.01, 0.03}) {
            World world(without_gravity());
            world.add_body(block.at({0, 0, -1.05}, Eigen::Matrix3d::Identity(), {5, 0, 0}));
            CordJoint cord{.from = {0, 0, -1}, .to = {0, 0, 0}};
            if (is_tendon) cord.tension = constant(0);
            cord.pulls_only = !is_tendon;
            world.add_joint({.name = "rope", .a = 0, .b = -1, .kind = cord});
            if (is_tendon) world.add_tendon({.parts = {0}, .winch = constant(1)});
            double first = 0;
            for (int step = 0; step < 400; ++step) {
                const WorldReport report = world.step(dt);
                ASSERT_EQ(report.failure, "");
                if (step == 0) first = report.kinetic_energy;
                ASSERT_LT(report.kinetic_energy, 1.005 * first) << is_tendon << ' ' << dt << ' ' << step;
            }
        }
}

/// Of two bodies that nothing holds, by both rules; in long steps as far as energy allows.
TEST(Rope, BetweenFreeBodiesKeepsTheirAngularMomentum) {
    const Model block = rigid_block({0.1, 0.1, 0.1});
    for (const TimeIntegrator integrator : {TimeIntegrator::second_order, TimeIntegrator::backward_euler})
        for (const double dt : {0.002, 0.01, 0.03}) {
            WorldConfig config = without_gravity();
            config.step.integrator = integrator;
            World world(config);
            world.add_body(block.at({0, 0, 0}, Eigen::Matrix3d::Identity(), {1, 0, 0}));
            world.add_body(block.at({0, 0, 1}, Eigen::Matrix3d::Identity(), {-1, 0.3, 0}));
            world.add_joint(
                {.name = "rope",
                 .a = 0,
                 .b = 1,
                 .kind = CordJoint{
                     .from = {0.03, 0, 0.05}, .to = {0, 0.02, 0.95}, .length = 1.0, .pulls_only = true}});
            const auto angular = [&] {  // of rigid bodies: not that of masses at their nodes
                Vector3d sum = Vector3d::Zero();
                for (int b = 0; b < 2; ++b) {
                    const Momentum one = momentum_of(world.elastic(b), world.state(b));
                    sum += one.angular + test::centre_of_mass(world, b).cross(one.linear);
                }
                return sum;
            };
            const Vector3d begun = angular();
            for (double time = 0; time < 4; time += dt) {
                ASSERT_EQ(world.step(dt).failure, "");
                ASSERT_LT((angular() - begun).norm(), 5e-3 * begun.norm()) << dt;
            }
        }
}

/// Which a short rope holds together while contact holds them apart, and which spin.
TEST(Rope, BetweenBodiesThatPressMakesNoEnergy) {
    struct Spins {
        Vector3d of_a, of_b, velocity;
        double dt;
    };
    for (const auto& [of_a, of_b, velocity, dt] :
         {Spins{{-0.92, -2.52, 0.38}, {-3.3, 0.79, 12.19}, {0.22, 0.39, -0.4}, 0.01},
          Spins{{4.78, 1.58, -0.18}, {-11.18, 4.94, 12.27}, {1.24, 0.25, -0.31}, 0.005}}) {
        const double length = 0.02;
        World world(without_gravity());
        WorldBody a = rigid_block({0.3, 0.1, 0.1}).at({0, 0, 0}),
                  b = rigid_block({0.06, 0.05, 0.04}).at({0.18 + length, 0, 0});
        for (auto& [body, spin, centre, along] : {std::tuple(&a, of_a, Vector3d(0, 0, 0), Vector3d(0, 0, 0)),
                                                  {&b, of_b, Vector3d(0.18 + length, 0, 0), velocity}})
            for (Eigen::Index i = 0; i < body->state.v.rows(); ++i)
                body->state.v.row(i) =
                    along + spin.cross(Vector3d(body->state.x.row(i).transpose() - centre));
        world.add_body(std::move(a));
        world.add_body(std::move(b));
        world.add_joint(
            {.name = "rope",
             .a = 0,
             .b = 1,
             .kind = CordJoint{
                 .from = {0.15, 0, 0}, .to = {0.15 + length, 0, 0}, .length = length, .pulls_only = true}});
        double before = std::numeric_limits<double>::infinity();
        for (double time = 0; time < 1; time += dt) {
            const WorldReport report = world.step(dt);
            ASSERT_EQ(report.failure, "");
            ASSERT_LT(report.kinetic_energy, 1.01 * before) << dt << ' ' << time;
            before = report.kinetic_energy;
        }
    }
}

TEST(Rope, DoesNotHangOnAPlaceFarFromARigidBody) {
    const Model block = rigid_block({0.1, 0.1, 0.1});
    World world(without_gravity());
    world.add_body(block.at({0, 0, 0}));
    EXPECT_EQ(
        test::error_of<std::invalid_argument>([&] {
            world.add_joint({.name = "rope", .kind = CordJoint{.from = {1e6, 0, 0}, .to = {0, 0, 1}}});
        }),
        "joint \"rope\", body 0: a place at (1e+06, 0, 0) is farther from its rigid body than 1000 times its "
        "size");
}

}  // namespace
}  // namespace nbd
