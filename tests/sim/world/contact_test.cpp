#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <memory>
#include <numbers>
#include <string>

#include "meshing/body/rigid_body.hpp"
#include "sim/fem/momentum.hpp"
#include "sim/world/world.hpp"
#include "tests/meshing/shapes.hpp"
#include "tests/sim/support/momentum.hpp"
#include "tests/sim/world/box_model.hpp"
#include "tests/sim/world/cords.hpp"
#include "tests/support/box_body.hpp"
#include "tests/support/box_mesh.hpp"
#include "tests/support/error_of.hpp"
#include "tests/support/on_threads.hpp"

namespace nbd {
namespace {

using test::floor_at;
using test::is_balanced;
using test::Model;
using test::turned;

WorldConfig with_gravity(const Eigen::Vector3d& gravity = Eigen::Vector3d::Zero()) {
    return {.gravity = gravity};
}

TEST(Contacts, AFastThinSheetDoesNotPassAnother) {
    const Model sheet({0.8, 0.8, 0.03}, {6, 6, 1}), shot({0.2, 0.2, 0.03}, {2, 2, 1}, {.young = 1e6});
    WorldConfig config = with_gravity();
    config.step.max_substeps = 1;
    World world(config);
    world.add_body(sheet.at({0, 0, 0}));
    world.add_body(shot.at({0.03, 0.02, 0.2}, turned(0.3), {0, 0, -60}));
    double least = 1;
    for (int i = 0; i < 8; ++i) {
        const WorldReport report = world.step(5e-3);  // 0.3 m a step: ten thicknesses
        EXPECT_EQ(report.failure, "");
        EXPECT_TRUE(world.intersecting_faces().empty());
        least = std::min(least, report.least_distance);
    }
    EXPECT_GT(least, 0);
    EXPECT_LT(least, world.thickness());
    const std::vector<int> middle = test::nodes_where(
        sheet.body.tets.X, [](const Eigen::Vector3d& x) { return x.head<2>().norm() < 0.1; });
    EXPECT_GT(world.state(1).x.col(2).mean(), world.state(0).x(middle, 2).mean());
}

/// What slides over the edge between two triangles of a flat floor, that of an obstacle and of a body,
/// notices nothing.
TEST(Contacts, AnEdgeInsideOfAFlatFaceHoldsNothingBack) {
    const Model block = test::rigid_block({0.3, 0.2, 0.1}), plate = test::rigid_block({1.4, 1, 0.1});
    const Eigen::Vector3d along = Eigen::Vector3d(-1, 1.4, 0).normalized();  // across the diagonal
    const Eigen::Matrix3d about_z = Eigen::AngleAxisd(1.4, Eigen::Vector3d::UnitZ()).matrix();
    for (const bool is_body : {false, true})
        for (const double speed : {1.0, 3.6})
            for (int place = 0; place < 8; ++place) {
                WorldConfig config = with_gravity({0, 0, -9.81});
                config.contact.friction = 0;
                World world(config);
                const Eigen::Vector3d start = (place * 0.0045 - 0.25) * along + Eigen::Vector3d(0, 0, 0.0515);
                world.add_body(block.at(start, about_z, speed * along));
                WorldBody floor = plate.at({0, 0, -0.05});
                floor.grips = {Grip{.nodes = {0, 1, 2, 3}}};
                if (is_body)
                    world.add_body(std::move(floor));
                else
                    world.add_obstacle({.shape = std::make_shared<const StaticSurface>(TriMesh{
                                            plate.body.surface.X.rowwise() - Eigen::RowVector3d(0, 0, 0.05),
                                            plate.body.surface.F}),
                                        .friction = 0});
                while (world.time() < 0.4 / speed) {
                    ASSERT_EQ(world.step(0.01).failure, "");
                    const Eigen::Vector3d v = world.state(0).v.colwise().mean();
                    ASSERT_NEAR((v - v[2] * Eigen::Vector3d::UnitZ() - speed * along).norm(), 0, 1e-3 * speed)
                        << is_body << ' ' << place << ' ' << world.time();
                }
            }
}

/// Nor does a rigid ball with flat faces lose speed over a floor of small triangles: the planes across lines
/// to edges ahead of it lead up, and it never meets them.
TEST(Contacts, EdgesOfAFlatFloorHoldNoBallBack) {
    const Model ball(make_rigid_body("ball", test::moved(test::icosphere(2), 0, 0, 0, 0.05), 1000), true);
    const auto floor =
        std::make_shared<const StaticSurface>(test::moved(test::box(1.2, 1.2, 0.1, 60), -0.6, -0.6, -0.1));
    for (const auto& [speed, dt] : {std::pair(0.5, 0.01), {2.0, 0.005}})
        for (int place = 0; place < 3; ++place) {
            WorldConfig config = with_gravity({0, 0, -9.81});
            config.contact.friction = 0;
            World world(config);
            world.add_body(ball.at({-0.4, 0.003 + 0.005 * place, 0.0502}, turned(0.4 * place),
                                   speed * Eigen::Vector3d::UnitX()));
            world.add_obstacle({.shape = floor, .friction = 0});
            while (world.time() < 0.7 / speed) ASSERT_EQ(world.step(dt).failure, "");
            const Eigen::Vector3d v = test::linear_momentum(world, 0) / ball.elastic->mass();
            EXPECT_NEAR(v.x(), speed, 5e-3 * speed) << speed << ' ' << place;
        }
}

TEST(Contacts, ABlockRestsAndSlidesOnlyOnSteepSlopes) {
    const Model box({0.4, 0.4, 0.2}, {2, 2, 1}, {.young = 1e6});
    const double slope = 0.35, g = 9.81;  // tan 0.35 = 0.365
    const auto travelled = [&](double friction) {
        World world(with_gravity({g * std::sin(slope), 0, -g * std::cos(slope)}));
        world.add_obstacle(floor_at(0, friction));
        world.add_body(box.at({0, 0, 0.1004}));
        const double start = world.state(0).x.col(0).mean();
        for (int i = 0; i < 100; ++i) {
            const WorldReport report = world.step(5e-3);
            EXPECT_TRUE(is_balanced(report)) << report.failure << report.rejection;
        }
        EXPECT_GT(world.state(0).x.col(2).minCoeff(), 0);
        return world.state(0).x.col(0).mean() - start;
    };
    EXPECT_LT(travelled(0.5), 2e-3);
    const double slid = travelled(0.2), expected = 0.5 * g * (std::sin(slope) - 0.2 * std::cos(slope)) * 0.25;
    EXPECT_NEAR(slid, expected, 0.05 * expected);
}

/// A strip whose ends are brought together by grips: only contact with itself can keep them apart.
TEST(Contacts, ABodyMeetsItself) {
    const Model strip({1, 0.2, 0.04}, {16, 2, 1}, {.young = 2e5});
    WorldConfig config = with_gravity();
    config.contact.thickness = 0.02;
    World world(config);
    world.add_body(test::strip_whose_ends_meet(strip));
    int touched = 0;
    for (int i = 0; i < 60; ++i) {
        const WorldReport report = world.step(5e-3);
        ASSERT_EQ(report.failure, "") << i;
        touched += report.contacts > 0;
    }
    EXPECT_GT(touched, 2);
}

TEST(Contacts, ArmsOfABodyThatClapDoNotPassEachOther) {
    constexpr double height = 0.1;
    Body body = test::box_body({2, 0.1, height}, {80, 4, 4});
    body.tets.X.rowwise() -= body.tets.X.colwise().mean().eval();
    body.tets.X = test::hairpin(body.tets.X, height, 0.04);
    World world(with_gravity());
    WorldBody arms{.elastic = std::make_shared<const ElasticBody>(body), .W = body.W, .F = body.surface.F};
    arms.state = {body.tets.X, Nodes::Zero(body.tets.X.rows(), 3)};
    for (Eigen::Index i = 0; i < body.tets.X.rows(); ++i)
        if (body.tets.X(i, 0) < -0.3) arms.state.v(i, 2) = body.tets.X(i, 2) < 0 ? 1 : -1;
    world.add_body(std::move(arms));
    int contacts = 0;
    for (int step = 0; step < 40; ++step) {
        const WorldReport report = world.step(2e-3);
        EXPECT_EQ(report.failure, "");
        contacts += report.contacts;
        EXPECT_TRUE(world.intersecting_faces().empty()) << step;
    }
    EXPECT_GT(contacts, 100);
}

TEST(Contacts, FailsWhereGripsForceAnIntersection) {
    const Model box({0.4, 0.4, 0.4}, {2, 2, 2});
    World world(with_gravity());
    WorldBody still = box.at({0, 0, 0}), pushed = box.at({0.41, 0, 0});
    std::vector<int> all;
    for (int i = 0; i < still.state.x.rows(); ++i) all.push_back(i);
    still.grips.push_back({.nodes = all});
    pushed.grips.push_back({.nodes = all, .motion = eased({.translation = {-0.2, 0, 0}, .duration = 0.02})});
    world.add_body(still);
    world.add_body(pushed);
    WorldReport report;
    for (int i = 0; i < 10 && report.failure.empty(); ++i) report = world.step(5e-3);
    EXPECT_NE(report.failure.find("of their way without an intersection"), std::string::npos)
        << report.failure;
    EXPECT_TRUE(world.intersecting_faces().empty());
}

/// Nothing that the detection along the way lets through is kept. It lets nothing through from a start
/// without intersections, so that one is made behind the world's back, of faces whose corners and sides stay
/// far apart.
TEST(Contacts, AnEndThatIntersectsIsRefused) {
    const Model box({0.4, 0.4, 0.4}, {1, 1, 1});
    World world(with_gravity());
    world.add_body(box.at({0, 0, 0}));
    world.add_body(box.at({1, 0.05, 0.07}, turned(0.3)));
    ASSERT_TRUE(is_balanced(world.step(1e-3)));
    const_cast<Nodes&>(world.state(1).x).col(0).array() -= 0.7;
    const BodyState before = world.state(1);
    const auto intersecting = world.intersecting_faces();
    ASSERT_FALSE(intersecting.empty());
    const WorldReport report = world.step(1e-3);
    EXPECT_NE(report.failure.find("the step would end where " + std::to_string(intersecting.size()) +
                                  " face pairs intersect: face "),
              std::string::npos)
        << report.failure;
    EXPECT_TRUE(world.state(1).x == before.x);
}

TEST(Contacts, StepsAreTheSameOnAnyNumberOfThreadsAndFromASnapshot) {
    const Model box({0.6, 0.4, 0.3}, {3, 2, 2});
    const auto fill = [&](World& world) {
        world.add_obstacle(floor_at(-0.2));
        world.add_body(box.at({0, 0, 0}, turned(0.2), {1.2, 0.1, 0}));
        world.add_body(box.at({0.72, 0.1, 0.05}, turned(-0.5), {-1.8, 0, 0.1}));
    };
    const auto run = [&](bool cut) {
        auto world = std::make_unique<World>(with_gravity({0, 0, -9.81}));
        fill(*world);
        int contacts = 0;
        for (int i = 0; i < 24; ++i) {
            if (cut && i == 14) {
                const WorldSnapshot snapshot = world->snapshot();
                world = std::make_unique<World>(with_gravity({0, 0, -9.81}));
                fill(*world);
                world->restore(snapshot);
            }
            contacts += world->step(5e-3).contacts;
        }
        EXPECT_GT(contacts, 10);
        return world->state(1);
    };
    const BodyState one = test::on_threads(1, [&] { return run(false); });
    for (const BodyState& other :
         {test::on_threads(4, [&] { return run(false); }), test::on_threads(1, [&] { return run(true); })}) {
        EXPECT_TRUE(one.x == other.x);
        EXPECT_TRUE(one.v == other.v);
    }
}

/// An undamped bar of half a metre hits a frictionless floor lengthwise at 1 m/s, and leaves it.
TEST(Contacts, TheSecondOrderRuleKeepsTheEnergyOfAnImpact) {
    const Model bar(
        {0.5, 0.1, 0.1}, {10, 2, 2},
        {.young = 1e6, .poisson = 0, .density = 1000, .rayleigh_mass = 0, .rayleigh_stiffness = 0});
    const auto leaves = [&](TimeIntegrator integrator) {
        WorldConfig config = with_gravity();
        config.step.integrator = integrator;
        World world(config);
        world.add_obstacle({.shape = PlaneShape{.point = {-0.25 - 1e-3, 0, 0}, .normal = {1, 0, 0}}});
        world.add_body(bar.at({0, 0, 0}, Eigen::Matrix3d::Identity(), {-1, 0, 0}));
        const double dt = 2 * 0.5 / std::sqrt(1e6 / 1000) / 100;
        for (int i = 0; i < 250; ++i) {
            EXPECT_TRUE(is_balanced(world.step(dt)));
            EXPECT_TRUE(world.intersecting_faces().empty());
        }
        EXPECT_TRUE(world.contact_forces(0).isZero(0));
        return momentum_of(world.elastic(0), world.state(0)).linear[0] / world.elastic(0).mass();
    };
    const double first_order = leaves(TimeIntegrator::backward_euler),
                 second_order = leaves(TimeIntegrator::second_order);
    EXPECT_LT(first_order, 0.9);
    EXPECT_GT(second_order, 0.91);
    EXPECT_LT(second_order, 1);
}

/// At the distance at which the barrier begins to press, a body only sinks a little.
TEST(Contacts, ABodyAtTheBarriersDistanceDoesNotHop) {
    const Model box({0.4, 0.4, 0.2}, {2, 2, 1}, {.young = 1e6});
    WorldConfig config = with_gravity({0, 0, -9.81});
    config.contact.thickness = 6e-4;
    World world(config);
    world.add_obstacle(floor_at(0));
    world.add_body(box.at({0, 0, 0.1 + 6e-4}));
    const double start = world.state(0).x.col(2).minCoeff();
    for (int i = 0; i < 60; ++i) {
        EXPECT_TRUE(is_balanced(world.step(5e-3)));
        EXPECT_LT(world.state(0).x.col(2).minCoeff(), start + 1e-5);
    }
}

TEST(Contacts, FacesThatTouchAtRestDoNotPress) {
    const Model box({0.4, 0.4, 0.4}, {2, 2, 2});
    World world(with_gravity());
    WorldBody body = box.at({0, 0, 0});
    // Two neighbours in one place.
    std::vector<Eigen::Triplet<double>> weights;
    for (Eigen::Index v = 0; v < body.W.rows(); ++v)
        for (Embedding::InnerIterator entry(body.W, v == body.F(0, 1) ? body.F(0, 0) : v); entry; ++entry)
            weights.emplace_back(v, entry.col(), entry.value());
    body.W.setFromTriplets(weights.begin(), weights.end());
    body.tree = nullptr;
    world.add_body(std::move(body));
    EXPECT_GT(world.touching_at_rest().size(), 3u);
    EXPECT_TRUE(world.intersecting_faces().empty());
    for (int i = 0; i < 20; ++i) ASSERT_EQ(world.step(1e-3).failure, "");
    EXPECT_LT(world.state(0).v.cwiseAbs().maxCoeff(), 1e-12);
}

}  // namespace
}  // namespace nbd
