// Muscles and tendons against closed forms.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <cmath>
#include <memory>
#include <numeric>
#include <string>
#include <vector>

#include "meshing/body/make_body.hpp"
#include "meshing/body/rigid_body.hpp"
#include "meshing/surface/quadratic_tets.hpp"
#include "sim/fem/momentum.hpp"
#include "sim/world/world.hpp"
#include "tests/meshing/shapes.hpp"
#include "tests/sim/support/momentum.hpp"
#include "tests/sim/world/box_model.hpp"
#include "tests/sim/world/cords.hpp"
#include "tests/support/box_mesh.hpp"
#include "tests/support/error_of.hpp"

namespace nbd {
namespace {

using Eigen::Vector3d;
using test::constant;
using test::Model;
using test::pulled;
using test::rigid_block;
using test::without_gravity;

const Material undamped{.young = 1e5, .poisson = 0.3, .rayleigh_mass = 0};

Model block(const Vector3d& size, const Eigen::Vector3i& cells, bool is_quadratic) {
    if (!is_quadratic) return Model(size, cells, undamped);
    TetMesh mesh = make_quadratic(test::box_mesh(size, cells));
    mesh.X.rowwise() -= 0.5 * size.transpose();
    return Model(make_body("block", std::move(mesh), undamped), true);
}

BodyLoad muscle_of(const WorldBody& body, const Vector3d& fibres, double tension) {
    BodyLoad load{.kind = LoadKind::muscle, .tension = tension};
    load.tets.resize(body.elastic->element_count());
    std::iota(load.tets.begin(), load.tets.end(), 0);
    load.fibres.assign(load.tets.size(), fibres);
    return load;
}

Vector3d extent(const Nodes& x) { return (x.colwise().maxCoeff() - x.colwise().minCoeff()).transpose(); }

/// A block whose fibres run along x, turned in space, comes to rest shorter by tension / E, and wider by
/// Poisson's ratio of that.
TEST(Muscles, ShortenABlockByTheirTensionOverYoungsModulus) {
    for (const bool is_quadratic : {false, true})
        for (const double strain : {0.01, 0.05}) {
            const Vector3d size(0.4, 0.2, 0.1);
            const Model model = block(size, {4, 2, 1}, is_quadratic);
            WorldConfig config = without_gravity(TimeIntegrator::backward_euler);
            config.linear.tolerance = 1e-9;
            World world(config);
            const Eigen::Matrix3d R = test::turned(0.7);
            WorldBody body = model.at({0, 0, 0}, R);
            body.loads = {muscle_of(body, Vector3d::UnitX(), strain * undamped.young)};
            world.add_body(std::move(body));
            for (int step = 0; step < 60; ++step) ASSERT_TRUE(test::is_balanced(world.step(0.02)));
            const Eigen::Matrix3d F = world.elastic(0).deformation_gradient(world.state(0).x, 0);
            const Vector3d change = F.colwise().norm().transpose().array() - 1;
            EXPECT_NEAR(change[0], -strain, 0.01 * strain) << is_quadratic;
            EXPECT_NEAR(change[1], 0.3 * strain, 0.01 * strain) << is_quadratic;
            EXPECT_NEAR(change[2], 0.3 * strain, 0.01 * strain) << is_quadratic;
        }
}

/// Slanted fibres bend and shear a free body without moving or turning it.
TEST(Muscles, KeepTheMomentumOfAFreeBody) {
    for (const bool is_quadratic : {false, true}) {
        const Model model = block({0.4, 0.2, 0.1}, {4, 2, 1}, is_quadratic);
        World world(without_gravity());
        WorldBody body = model.at({0, 0, 0});
        BodyLoad load = muscle_of(body, Vector3d(1, 1, 0.5).normalized(), 2e3);
        load.tets.resize(load.tets.size() / 3);
        load.fibres.resize(load.tets.size());
        body.loads = {load};
        world.add_body(std::move(body));
        const Vector3d before = extent(world.state(0).x);
        for (int step = 0; step < 40; ++step) ASSERT_TRUE(test::is_balanced(world.step(2e-3)));
        EXPECT_GT((extent(world.state(0).x) - before).norm(), 1e-4);
        EXPECT_LT(test::linear_momentum(world, 0).norm(), 1e-9);
        EXPECT_LT(momentum_of(world.elastic(0), world.state(0)).angular.norm(), 1e-9) << is_quadratic;
    }
}

TEST(Muscles, RefuseWhatHasNoMeaning) {
    const Model model = block({0.4, 0.2, 0.1}, {2, 1, 1}, false);
    const auto error = [&](BodyLoad load) {
        World world(without_gravity());
        WorldBody body = model.at({0, 0, 0});
        body.loads = {std::move(load)};
        return test::error_of<std::invalid_argument>([&] { world.add_body(std::move(body)); });
    };
    BodyLoad load = muscle_of(model.at({0, 0, 0}), Vector3d::UnitX(), 1);
    load.tets.back() = 1000;
    EXPECT_NE(error(load).find("tetrahedron 1000 is not in 0.."), std::string::npos);
    load = muscle_of(model.at({0, 0, 0}), Vector3d(2, 0, 0), 1);
    EXPECT_EQ(error(load), "load: the direction of a muscle's fibres needs the length 1");
    load.fibres.clear();
    EXPECT_EQ(error(load), "load: a muscle needs tetrahedra, and a direction of fibres for each");
}

/// Two free blocks pull each other with a tendon that bends about a point of a third: momentum stays, and the
/// work of the tension is the kinetic energy.
TEST(Tendons, KeepMomentumAndTheirWorkIsTheGainInEnergy) {
    for (const double dt : {1e-3, 4e-3}) {
        const Model model = rigid_block({0.1, 0.1, 0.1});  // 1 kg
        World world(without_gravity());
        const Vector3d at[] = {{0, 0, 0}, {1, 0, 0}, {1, 0.8, 0.2}};
        for (const Vector3d& place : at) world.add_body(model.at(place));
        constexpr double tension = 2;
        const Vector3d off(0.02, -0.03, 0.04);  // beside the centres, so that blocks turn
        for (const int k : {0, 1})
            world.add_joint(
                {.a = k, .b = k + 1, .kind = pulled(at[k] + off, at[k + 1] + off, constant(tension))});
        const auto length = [&] { return world.joint_value(0) + world.joint_value(1); };
        const double begin = length();
        EXPECT_NEAR(begin, 1 + std::hypot(0.8, 0.2), 1e-12);
        WorldReport report;
        while (world.time() < 0.3 - dt / 2) {
            report = world.step(dt);
            ASSERT_TRUE(test::is_balanced(report)) << report.rejection;
        }
        Vector3d linear = Vector3d::Zero(), angular = Vector3d::Zero();
        for (int b = 0; b < 3; ++b) {
            linear += test::linear_momentum(world, b);
            const Momentum own = momentum_of(world.elastic(b), world.state(b));
            angular += own.angular + centre_of_mass(world.elastic(b), world.state(b).x).cross(own.linear);
        }
        EXPECT_LT(linear.norm(), 1e-9);
        EXPECT_LT(angular.norm(), dt);  // of some 0.03 of each block, and less with shorter steps
        const double work = tension * (begin - length());
        EXPECT_GT(work, 0.1);
        EXPECT_NEAR(report.kinetic_energy, work, (dt > 2e-3 ? 2e-2 : 5e-3) * work);
        double forces = 0;
        for (const Reaction& reaction : world.reactions())
            if (reaction.by == ReactionBy::joint && reaction.number == 0 && reaction.body == 0)
                forces = reaction.force.norm();
        EXPECT_NEAR(forces, tension, 1e-3 * tension);
    }
}

/// Blocks that a tendon pulls together keep their momentum when they meet and bounce, in long steps, too.
TEST(Tendons, BlocksThatTheyPullTogetherKeepTheirMomentum) {
    for (const double size : {0.002, 0.2})
        for (const double dt : {1e-3, 0.05}) {
            const Model model = rigid_block({size, size, size});
            const double mass = model.elastic->mass(), tension = 25 * mass;
            World world(without_gravity());
            const Vector3d other = Vector3d(1.25, 0.15, 0) * size;
            world.add_body(model.at({0, 0, 0}));
            world.add_body(model.at(other));
            world.add_joint({.a = 0,
                             .b = 1,
                             .kind = pulled(Vector3d(0, 0.5, 0) * size, other + Vector3d(0, 0, 0.5) * size,
                                            constant(tension * size))});
            double fastest = 0;
            while (world.time() < 0.5 - dt / 2) {
                const Vector3d before = test::linear_momentum(world, 0);
                const WorldReport report = world.step(dt);
                ASSERT_EQ(report.failure, "") << size << ' ' << dt;
                fastest = std::max(fastest, test::linear_momentum(world, 0).norm());
                const Vector3d sum = test::linear_momentum(world, 0) + test::linear_momentum(world, 1);
                ASSERT_LT(sum.norm(), 1e-8 * fastest) << size << ' ' << dt << ' ' << world.time();
                // Reactions are what the body got, also where it was refused what the solver had left.
                Vector3d got = Vector3d::Zero();
                double largest = 0;
                for (const Reaction& reaction : world.reactions()) {
                    const double sign = reaction.by == ReactionBy::joint && reaction.body == 1 ? 0 : 1;
                    got += sign * reaction.force;
                    largest = std::max(largest, reaction.force.norm());
                }
                const Vector3d change = (test::linear_momentum(world, 0) - before) / dt;
                ASSERT_LT((got - change).norm(), 1e-3 * largest) << size << ' ' << dt << ' ' << world.time();
            }
            EXPECT_GT(fastest, 0.1 * mass * size);
        }
}

/// At a bend it pulls by 2 T sin(a / 2), at its ends by T, as reactions tell.
TEST(Tendons, PullAtABendByTheirTensionAndTheAngle) {
    for (const double angle : {0.3, 1.5, 2.8}) {
        const Model model = rigid_block({0.1, 0.1, 0.1});
        World world(without_gravity());
        WorldBody body = model.at({0, 0, 0});
        body.grips = {{.nodes = {0, 1, 2, 3}, .motion = {}}};
        world.add_body(std::move(body));
        constexpr double tension = 7;
        const Vector3d ends[] = {{-1, 0, 0}, {2 * std::cos(angle), 2 * std::sin(angle), 0}};
        for (const Vector3d& end : ends)
            world.add_joint({.a = 0, .b = -1, .kind = pulled({0, 0, 0}, end, {{0, 0.1}, {0, tension}})});
        WorldReport report;
        for (int step = 0; step < 40; ++step) ASSERT_TRUE(test::is_balanced(world.step(5e-3)));
        Vector3d sum = Vector3d::Zero(), held = Vector3d::Zero();
        for (const Reaction& reaction : world.reactions()) {
            if (reaction.by == ReactionBy::grip) held += reaction.force;
            if (reaction.by != ReactionBy::joint) continue;
            sum += reaction.force;
            EXPECT_NEAR(reaction.force.norm(), tension, 1e-6 * tension);
        }
        EXPECT_NEAR(sum.norm(), 2 * tension * std::sin(angle / 2), 1e-6 * tension);
        EXPECT_LT((sum + held).norm(), 1e-6 * tension);
    }
}

/// A tendon from end to end of one soft block bends it without moving or turning it, and is gone where its
/// factor ends.
TEST(Tendons, BendASoftBodyThatTheyRunThrough) {
    const Model model = block({0.4, 0.06, 0.06}, {10, 2, 2}, false);
    World world(without_gravity());
    world.add_body(model.at({0, 0, 0}));
    const Vector3d way[] = {{-0.19, 0, 0.025}, {0, 0, 0.028}, {0.19, 0, 0.025}};
    for (const int k : {0, 1})
        world.add_joint({.a = 0, .b = 0, .kind = pulled(way[k], way[k + 1], {{0, 0.1}, {0, 2}})});
    double shortest = 1;
    for (int step = 0; step < 200; ++step) {
        ASSERT_EQ(world.step(2e-3).failure, "");
        shortest = std::min(shortest, world.joint_value(0) + world.joint_value(1));
    }
    EXPECT_LT(shortest, 0.99 * 0.38);
    const Nodes& x = world.state(0).x;
    EXPECT_LT(test::linear_momentum(world, 0).norm(), 1e-9);
    EXPECT_LT(test::angular_momentum(world, 0, Vector3d::Zero()).norm(), 1e-6);
    double end = 0, middle = 0;
    const Nodes& X = model.body.tets.X;
    for (Eigen::Index i = 0; i < x.rows(); ++i) {
        if (std::abs(std::abs(X(i, 0)) - 0.2) < 1e-9 && std::abs(X(i, 2)) < 1e-9)
            end = std::max(end, x(i, 2));
        if (std::abs(X(i, 0)) < 1e-9 && std::abs(X(i, 2)) < 1e-9) middle = std::min(middle, x(i, 2));
    }
    EXPECT_GT(end - middle, 0.003);  // towards the tendon's side
}

TEST(Tendons, ContinueFromASnapshotWithTheSameBits) {
    const auto made = [] {
        static const Model model = block({0.3, 0.1, 0.1}, {3, 1, 1}, false);
        World world(WorldConfig{});
        WorldBody body = model.at({0, 0, 0});
        body.loads = {muscle_of(body, Vector3d::UnitZ(), 500)};
        world.add_body(std::move(body));
        world.add_joint(
            {.a = 0, .b = -1, .kind = pulled({0.1, 0, 0.04}, {0.4, 0.1, 0.5}, {{0, 0.1}, {1, 5}})});
        return world;
    };
    World whole = made();
    for (int step = 0; step < 10; ++step) whole.step(5e-3);
    const WorldSnapshot snapshot = whole.snapshot();
    World resumed = made();
    resumed.restore(snapshot);
    for (int step = 0; step < 10; ++step) {
        whole.step(5e-3);
        resumed.step(5e-3);
    }
    EXPECT_EQ(whole.state(0).x, resumed.state(0).x);
    EXPECT_EQ(whole.state(0).v, resumed.state(0).v);
}

TEST(Tendons, RefuseWhatHasNoMeaning) {
    const Model model = rigid_block({0.1, 0.1, 0.1});
    const auto error = [&](CordJoint cord) {
        World world(without_gravity());
        world.add_body(model.at({0, 0, 0}));
        return test::error_of<std::invalid_argument>([&] { world.add_joint({.name = "t", .kind = cord}); });
    };
    EXPECT_EQ(error(pulled({0, 0, 0}, {1, 0, 0}, {{0, 1}, {1, -1}})),
              "joint \"t\": its tension needs finite numbers >= 0");
    EXPECT_EQ(error(pulled({0, 0, 0}, {1, 0, 0}, {{0, 0}, {1, 1}})),
              "joint \"t\": the times of its tension must ascend");
    CordJoint two = pulled({0, 0, 0}, {1, 0, 0}, constant(1));
    two.stiffness = 5;
    EXPECT_EQ(
        error(two),
        "joint \"t\": a tension that is given leaves nothing to stiffness, damping and length; name one "
        "of them");
}

/// Radians by which a body has turned since it was at rest, in the mean of its nodes.
double turn_of(const World& world) {
    const ElasticBody& elastic = world.elastic(0);
    const Nodes &x = world.state(0).x, &X = elastic.rest().X;
    const Eigen::RowVector3d now = centre_of_mass(elastic, x).transpose(),
                             rest = centre_of_mass(elastic, X).transpose();
    const Eigen::Matrix3d A =
        (x.rowwise() - now).transpose() * elastic.node_masses().asDiagonal() * (X.rowwise() - rest);
    const Eigen::JacobiSVD<Eigen::Matrix3d> svd(A, Eigen::ComputeFullU | Eigen::ComputeFullV);
    return Eigen::AngleAxisd(svd.matrixU() * svd.matrixV().transpose()).angle();
}

/// Slanted fibres in a third of a free block contract by a tenth and more, at once and in long steps, by both
/// rules: it must not turn otherwise than in short steps.
TEST(Muscles, HardlyTurnAFreeBodyInLongSteps) {
    for (const bool is_quadratic : {false, true})
        for (const TimeIntegrator rule : {TimeIntegrator::second_order, TimeIntegrator::backward_euler}) {
            const Model model = block({0.4, 0.2, 0.1}, {4, 2, 1}, is_quadratic);
            std::vector<double> turns;
            for (const double dt : {5e-4, 2e-2}) {
                World world(without_gravity(rule));
                WorldBody body = model.at({0, 0, 0});
                BodyLoad load = muscle_of(body, Vector3d(1, 1, 0.5).normalized(), 2e4);
                load.tets.resize(load.tets.size() / 3);
                load.fibres.resize(load.tets.size());
                load.factor = {{0, 0.1}, {0, 1}};
                body.loads = {load};
                world.add_body(std::move(body));
                while (world.time() < 0.4 - dt / 2) ASSERT_EQ(world.step(dt).failure, "");
                turns.push_back(turn_of(world));
                EXPECT_LT(momentum_of(world.elastic(0), world.state(0)).angular.norm(), 1e-9);
            }
            RecordProperty("turn", std::to_string(turns[1] - turns[0]));
            EXPECT_LT(std::abs(turns[1] - turns[0]), 0.02)
                << turns[0] << " " << turns[1] << " " << is_quadratic << " " << static_cast<int>(rule);
        }
}

}  // namespace
}  // namespace nbd
