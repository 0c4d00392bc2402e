// Bodies that take different rules in one step: what spins fast, or is caught, by backward Euler, the others
// by the rule of second order.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <functional>
#include <memory>
#include <tuple>
#include <vector>

#include "tests/sim/support/momentum.hpp"
#include "tests/sim/world/box_model.hpp"
#include "tests/sim/world/cords.hpp"

namespace nbd {
namespace {

using test::Model;

constexpr Material undamped_rubber{
    .young = 1e5, .poisson = 0.3, .density = 1000, .rayleigh_mass = 0, .rayleigh_stiffness = 0};

WorldBody body_that_spins(const Model& model, const Eigen::Vector3d& at, const Eigen::Vector3d& spin) {
    WorldBody body = model.at(at);
    for (Eigen::Index i = 0; i < body.state.x.rows(); ++i)
        body.state.v.row(i) += spin.cross(body.state.x.row(i).transpose() - at).transpose();
    return body;
}

/// Of all bodies, about the origin.
Eigen::Vector3d whole_angular_momentum(const World& world) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (int b = 0; b < world.body_count(); ++b) {
        const Momentum momentum = momentum_of(world.elastic(b), world.state(b));
        sum += momentum.angular + test::centre_of_mass(world, b).cross(momentum.linear);
    }
    return sum;
}

double kinetic_energy_of(const World& world) {
    double sum = 0;
    for (int b = 0; b < world.body_count(); ++b) sum += kinetic_energy(world.elastic(b), world.state(b).v);
    return sum;
}

/// The nodes of a block that rings, after two hundred steps beside what `add` adds.
Nodes ringing(double size, double dt, const std::function<void(World&)>& add) {
    const Model block({size, size, size}, {2, 2, 2}, undamped_rubber);
    World world(test::without_gravity());
    WorldBody body = block.at({0, 0, 0});
    body.state.x.col(2) *= 1.05;
    world.add_body(std::move(body));
    add(world);
    for (int s = 0; s < 200; ++s) EXPECT_EQ(world.step(dt).failure, "");
    return world.state(0).x;
}

/// So does what hangs on the same thing, if that is held throughout: a pendulum beside a rotor.
TEST(MixedRules, AHeldBaseConnectsNothing) {
    const Model rod = test::rigid_block({0.02, 0.02, 0.2}), base = test::rigid_block({1, 0.05, 0.05}),
                rotor = test::rigid_block({0.1, 0.02, 0.1});
    const auto swing = [&](double spin) {
        World world(WorldConfig{});
        const Eigen::Vector3d axis = Eigen::Vector3d::UnitY();
        const Eigen::Matrix3d tilted = Eigen::AngleAxisd(-0.5, axis).matrix();
        world.add_body(rod.at(Eigen::Vector3d(0, 0.2, 0) - 0.1 * tilted.col(2), tilted));
        world.add_body(body_that_spins(rotor, {0.4, 0.2, 0}, {0, spin, 0}));
        WorldBody held = base.at({0, 0, 0});
        held.grips = {Grip{.nodes = {0, 1, 2, 3}}};
        world.add_body(std::move(held));
        world.add_joint({.a = 0, .b = 2, .kind = HingeJoint{.point = {0, 0.2, 0}, .axis = axis}});
        world.add_joint({.a = 1, .b = 2, .kind = HingeJoint{.point = {0.4, 0.2, 0}, .axis = axis}});
        for (int s = 0; s < 300; ++s) EXPECT_EQ(world.step(0.01).failure, "");
        return world.state(0).x;
    };
    EXPECT_LT((swing(40) - swing(0)).norm(), 1e-3);
}

/// A base that grips move has a rule of its own: what hangs on it and spins goes by another one.
Grip moving(const std::vector<int>& nodes, const Eigen::Vector3d& way, double time) {
    return {
        .nodes = nodes,
        .motion = {.keyframes = {{.to_next = Interpolation::linear}, {.time = time, .translation = way}}}};
}

/// Nothing pulls at what goes along with it.
TEST(MixedRules, ADamperOnABaseThatMovesLeavesWhatGoesAlong) {
    const Model block = test::rigid_block({0.1, 0.1, 0.1});
    const Eigen::Vector3d along(3, 0, 0);
    for (const double spin : {0.0, 40.0}) {
        World world(test::without_gravity());
        WorldBody rotor = body_that_spins(block, {1, 0, 0}, {0, spin, 0}), base = block.at({0, 0, 0});
        for (Nodes* v : {&rotor.state.v, &base.state.v}) v->rowwise() += along.transpose();
        base.grips = {moving({0, 1, 2, 3}, along, 1)};
        world.add_body(std::move(rotor));
        world.add_body(std::move(base));
        world.add_joint(
            {.a = 0, .b = 1, .kind = SliderJoint{.axis = along.normalized(), .way = {.damping = 20}}});
        for (int s = 0; s < 50; ++s) {
            ASSERT_EQ(world.step(0.01).failure, "");
            ASSERT_NEAR(test::linear_momentum(world, 0).x() / block.elastic->mass(), 3, 1e-3) << s;
        }
    }
}

/// What holds it bears force and torque of what hangs on it.
TEST(MixedRules, AHeldBaseBearsTheTorqueOfASpringOnARotor) {
    const Model base = test::rigid_block({1, 0.1, 0.1}), rotor = test::rigid_block({0.1, 0.1, 0.1});
    for (const double spin : {0.0, 40.0}) {
        World world(test::without_gravity());
        WorldBody held = base.at({0, 0, 0});
        held.grips = {Grip{.nodes = {0, 1, 2, 3}}};
        world.add_body(std::move(held));
        world.add_body(body_that_spins(rotor, {0.5, 1, 0}, {spin, 0, 0}));
        world.add_joint(
            {.a = 1,
             .b = 0,
             .kind = CordJoint{.from = {0.5, 1, 0}, .to = {0.5, 0, 0}, .stiffness = 50, .length = 0.5}});
        for (int s = 0; s < 30; ++s) {
            ASSERT_EQ(world.step(0.01).failure, "");
            Eigen::Vector3d force = Eigen::Vector3d::Zero(), torque = force;
            for (const Reaction& one : world.reactions())
                if (one.body == 0) force += one.force, torque += one.torque;
            ASSERT_LT(force.norm(), 1e-6) << spin << ' ' << s;
            ASSERT_LT(torque.norm(), 0.5) << spin << ' ' << s;  // of 12 N m; arms are of one time
        }
    }
}

/// A taut rope on a body that is held throughout catches nothing, again and again: the steps end.
TEST(MixedRules, ARopeThatCannotCatchAHeldBodyEndsItsSteps) {
    const Model block = test::rigid_block({0.1, 0.1, 0.1});
    World world(WorldConfig{});
    WorldBody body = block.at({0, 0, 0});
    body.grips = {moving({0, 1, 2, 3}, {1, 0, 0}, 1)};
    world.add_body(std::move(body));
    CordJoint rope{.from = {0.05, 0, 0}, .to = {-0.5, 0, 0}, .length = 0.6};
    rope.pulls_only = true;
    world.add_joint({.name = "rope", .a = 0, .kind = rope});
    for (int s = 0; s < 30; ++s) ASSERT_EQ(world.step(0.01).failure, "");
    EXPECT_NEAR(test::centre_of_mass(world, 0).x(), 0.3, 1e-9);
}

class Bystander : public ::testing::TestWithParam<std::tuple<double, double>> {};

/// What happens ten sizes away leaves a body alone, but for how often steps are linearised: four hundredths
/// of how it rings.
TEST_P(Bystander, RingsAsIfAlone) {
    const auto [size, dt] = GetParam();
    const Nodes alone = ringing(size, dt, [](World&) {});
    const Model rigid = test::rigid_block({size, size / 5, size / 5}),
                soft({size, size, size}, {2, 2, 2}, undamped_rubber);
    const Eigen::Vector3d away(0, 10 * size, 0);
    const Nodes beside_spinner = ringing(size, dt, [&](World& world) {
        world.add_body(body_that_spins(rigid, away, {0, 0.01 / dt, 0.45 / dt}));
    });
    EXPECT_LT((beside_spinner - alone).norm(), 1e-2 * size);
    const Nodes beside_caught = ringing(size, dt, [&](World& world) {  // to and fro between two ropes
        const int caught =
            world.add_body(rigid.at(away, Eigen::Matrix3d::Identity(), {size / (5 * dt), 0, 0}));
        for (const double side : {-1.0, 1.0})
            world.add_joint({.a = caught,
                             .kind = CordJoint{.from = away,
                                               .to = away + Eigen::Vector3d(side * 2 * size, 0, 0),
                                               .length = 2.5 * size,
                                               .pulls_only = true}});
    });
    EXPECT_LT((beside_caught - alone).norm(), 1e-2 * size);
}

INSTANTIATE_TEST_SUITE_P(SizesAndSteps, Bystander,
                         ::testing::Values(std::tuple(0.1, 5e-3), std::tuple(0.01, 2e-4),
                                           std::tuple(10.0, 2e-2)));

class HitBySpinner : public ::testing::TestWithParam<std::tuple<double, double, bool>> {};

/// A bar that spins too fast for the rule of second order hits a body that takes it; all this moves along,
/// too. Returns the nodes at the end, from where they have been carried.
std::vector<Nodes> hit_by_spinner(double size, double dt, bool is_soft, const Eigen::Vector3d& along) {
    const Model bar = test::rigid_block({size, size / 5, size / 5});
    const Model block = is_soft ? Model({size, size, size}, {2, 2, 2}, undamped_rubber)
                                : test::rigid_block({size, size, size});
    World world(test::without_gravity());
    WorldBody thrown = body_that_spins(bar, {0, -1.2 * size, 0.1 * size}, {0, 0, 0.4 / dt});
    thrown.state.v.col(1).array() += 0.02 * size / dt;
    thrown.state.v.rowwise() += along.transpose();
    world.add_body(std::move(thrown));
    world.add_body(block.at({0, 0, 0}, Eigen::Matrix3d::Identity(), along));
    const Eigen::Vector3d linear = test::linear_momentum(world), angular = whole_angular_momentum(world);
    const double begin = kinetic_energy_of(world);
    const bool is_carried = !along.isZero(0);
    for (int s = 0; s < 100; ++s) {
        EXPECT_EQ(world.step(dt).failure, "");
        if (!is_carried) {
            EXPECT_LT(kinetic_energy_of(world), 1.05 * begin) << s;
        }
    }
    std::vector<Nodes> ends;
    for (const int b : {0, 1}) ends.push_back(world.state(b).x.rowwise() - world.time() * along.transpose());
    if (is_carried) return ends;
    EXPECT_GT(test::linear_momentum(world, 1).norm(), 0.1 * linear.norm());  // it was hit
    EXPECT_LT((test::linear_momentum(world) - linear).norm(), 1e-9 * linear.norm());
    EXPECT_LT((whole_angular_momentum(world) - angular).norm(), (is_soft ? 0.1 : 0.05) * angular.norm());
    return ends;
}

TEST_P(HitBySpinner, KeepsMomentumAndMakesNoEnergyAlsoInAFrameThatMoves) {
    const auto [size, dt, is_soft] = GetParam();
    const std::vector<Nodes> at_rest = hit_by_spinner(size, dt, is_soft, {0, 0, 0});
    for (const Eigen::Vector3d& along :
         {Eigen::Vector3d(size / dt, 0, 0), Eigen::Vector3d(0, 0, 5 * size / dt)}) {
        const std::vector<Nodes> carried = hit_by_spinner(size, dt, is_soft, along);
        for (const int b : {0, 1}) EXPECT_LT((carried[b] - at_rest[b]).norm(), 0.01 * size) << b;
    }
}

INSTANTIATE_TEST_SUITE_P(SizesAndSteps, HitBySpinner,
                         ::testing::Values(std::tuple(0.1, 5e-3, true), std::tuple(0.1, 5e-3, false),
                                           std::tuple(0.01, 5e-4, true), std::tuple(10.0, 2e-2, false)));

/// Where something is in the way of one body and a step ends short of its solution, others keep their
/// velocity.
TEST(MixedRules, AStepThatEndsShortLeavesFreeBodiesTheirVelocity) {
    int ended_short = 0;
    for (const double speed : {20.0, 30.0, 40.0}) {
        Material soft = undamped_rubber;
        soft.young = 2e4;
        const Model block({0.2, 0.2, 0.2}, {3, 3, 3}, soft), rigid = test::rigid_block({0.2, 0.2, 0.2});
        WorldConfig config = test::without_gravity();
        config.step.max_substeps = 1;
        World world(config);
        world.add_body(rigid.at({100, 0, 5}, Eigen::Matrix3d::Identity(), {1, 0, 0}));
        world.add_body(block.at({0, 0, 1}, Eigen::Matrix3d::Identity(), {0, 0, -speed}));
        world.add_obstacle(test::floor_at(0));
        for (int s = 0; s < 12; ++s) {
            const WorldReport report = world.step(5e-3);
            ASSERT_EQ(report.failure, "");
            ended_short += report.trouble == StepTrouble::newton;
            ASSERT_LT((world.state(0).v.rowwise() - Eigen::RowVector3d(1, 0, 0)).norm(), 1e-6) << speed;
        }
    }
    EXPECT_GT(ended_short, 0);
}

/// Rigid bodies that fall on a soft one and tip over: a new world goes on from a snapshot with the same bits.
TEST(MixedRules, ANewWorldGoesOnWithTheSameBits) {
    const Model block({0.3, 0.3, 0.1}, {3, 3, 1}, undamped_rubber),
        plate = test::rigid_block({0.2, 0.2, 0.02}), bar = test::rigid_block({0.2, 0.04, 0.04});
    const auto made = [&] {
        auto world = std::make_unique<World>(WorldConfig{});
        world->add_obstacle(test::floor_at(0));
        world->add_body(block.at({0, 0, 0.06}));
        world->add_body(plate.at({0.02, 0.01, 0.24}, test::turned(0.7)));
        world->add_body(bar.at({-0.05, 0.02, 0.45}, test::turned(1.2)));
        return world;
    };
    constexpr double dt = 0.01;
    const std::unique_ptr<World> whole = made();
    std::vector<WorldSnapshot> snapshots;
    for (int s = 0; s < 40; ++s) {
        snapshots.push_back(whole->snapshot());
        ASSERT_EQ(whole->step(dt).failure, "");
    }
    for (const int from : {12, 18, 24, 30}) {
        const std::unique_ptr<World> again = made();
        again->restore(snapshots[from]);
        for (int s = from; s < 40; ++s) ASSERT_EQ(again->step(dt).failure, "");
        for (int b = 0; b < 3; ++b) EXPECT_EQ(again->state(b).x, whole->state(b).x) << from << ' ' << b;
    }
}

}  // namespace
}  // namespace nbd
