// What touches or overlaps before the first step: found, told, refused and moved apart.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "meshing/body/make_body.hpp"
#include "meshing/body/rigid_body.hpp"
#include "sim/world/start_check.hpp"
#include "sim/world/world.hpp"
#include "tests/meshing/shapes.hpp"
#include "tests/sim/support/momentum.hpp"
#include "tests/sim/world/box_model.hpp"
#include "tests/support/box_body.hpp"
#include "tests/support/error_of.hpp"

namespace nbd {
namespace {

using test::floor_at;
using test::is_balanced;
using test::Model;
using test::turned;

TEST(Start, RefusesAStartThatIntersects) {
    const Model box({0.6, 0.4, 0.3}, {3, 2, 2});
    World world(WorldConfig{.gravity = Eigen::Vector3d::Zero()});
    world.add_body(box.at({0, 0, 0}));
    world.add_body(box.at({0.5, 0.1, 0.05}));
    const std::string text = test::refusal([&] { world.step(5e-3); });
    EXPECT_NE(text.find("bodies must start without intersections, but "), std::string::npos) << text;
    EXPECT_NE(text.find(" face pairs intersect: face "), std::string::npos) << text;
    EXPECT_NE(text.find("`resolve_start` moves bodies apart"), std::string::npos) << text;
    EXPECT_EQ(world.time(), 0);
}

TEST(Start, AStartThatIntersectsIsMended) {
    const Model box({0.4, 0.4, 0.4}, {2, 2, 2});
    World world(WorldConfig{.gravity = Eigen::Vector3d::Zero()});
    world.add_obstacle(floor_at(-0.15));
    world.add_body(box.at({0, 0, 0}));
    world.add_body(box.at({0.3, 0.1, 0.1}, turned(0.4)));
    world.add_body(box.at({3, 0, 0.5}));
    EXPECT_NE(test::refusal([&] { world.check_start(); }), "");
    const std::vector<StartMove> moves = world.resolve_start();
    ASSERT_EQ(moves.size(), 2u);
    EXPECT_EQ(moves[0].body, 0);
    EXPECT_GT(moves[0].by.z(), 0.05);  // out of the floor
    EXPECT_EQ(moves[1].body, 1);
    EXPECT_LT(moves[1].by.norm(), 0.5);
    world.check_start();
    EXPECT_TRUE(is_balanced(world.step(1e-3)));
    EXPECT_TRUE(world.resolve_start().empty());
}

TEST(Start, BodiesNearerThanTheFloorAreRefusedAndMovedApart) {
    const Model box({0.4, 0.4, 0.4}, {2, 2, 2});
    World world(WorldConfig{.gravity = Eigen::Vector3d::Zero()});
    world.add_body(box.at({0, 0, 0}));
    world.add_body(box.at({0.4 + 1e-8, 0.1, 0}));
    const std::string text = test::refusal([&] { world.step(1e-3); });
    EXPECT_NE(text.find("surfaces must start apart"), std::string::npos) << text;
    EXPECT_NE(text.find("`resolve_start` moves bodies apart"), std::string::npos) << text;
    const std::vector<StartMove> moves = world.resolve_start();
    ASSERT_EQ(moves.size(), 2u);
    EXPECT_LT(moves[0].by.norm(), 2 * world.thickness());
    EXPECT_TRUE(is_balanced(world.step(1e-3)));
    EXPECT_LT(world.state(1).v.cwiseAbs().maxCoeff(), 1e-9);
}

TEST(Start, HeldBodiesAreNotMovedApart) {
    const Model box({0.4, 0.4, 0.4}, {2, 2, 2});
    World world(WorldConfig{.gravity = Eigen::Vector3d::Zero()});
    for (const double x : {0.0, 0.3}) {
        WorldBody body = box.at({x, 0, 0});
        body.grips = {{.nodes = {0}}};
        world.add_body(std::move(body));
    }
    EXPECT_NE(test::refusal([&] { world.resolve_start(); }).find("bodies cannot be moved apart"),
              std::string::npos);
}

TEST(Start, AStartInAnObstacleIsRefused) {
    const Model box({0.4, 0.4, 0.4}, {2, 2, 2});
    const auto refused = [&](const Obstacle& obstacle) {
        World world(WorldConfig{.gravity = Eigen::Vector3d::Zero()});
        world.add_obstacle(obstacle);
        world.add_body(box.at({0, 0, 0}));
        return test::refusal([&] { world.check_start(); });
    };
    EXPECT_NE(refused(floor_at(-0.19)).find("surfaces must start apart"), std::string::npos);
    EXPECT_EQ(refused(floor_at(-0.21)), "");
    EXPECT_NE(refused({.shape = BallShape{.centre = {0.3, 0.2, 0.2}, .radius = 0.15}}), "");
    const TriMesh mesh{(0.5 * box.body.surface.X).rowwise() + Eigen::RowVector3d(0.25, 0, 0),
                       box.body.surface.F};
    EXPECT_NE(refused({.shape = std::make_shared<const StaticSurface>(mesh)}).find("obstacle mesh 0"),
              std::string::npos);
}

TEST(Start, BodiesLeaveMeshesByTheShortestWay) {
    const Model box({0.4, 0.4, 0.4}, {2, 2, 2});
    const Body ground = test::box_body({10, 10, 1}, {8, 8, 1});
    World world(WorldConfig{.gravity = Eigen::Vector3d::Zero()});
    world.add_obstacle(
        {.shape = std::make_shared<const StaticSurface>(
             TriMesh{ground.surface.X.rowwise() - ground.surface.X.colwise().mean(), ground.surface.F})});
    world.add_body(box.at({3, 0, 0.65}, turned(0.3)));
    const std::vector<StartMove> moves = world.resolve_start();
    ASSERT_EQ(moves.size(), 1u);
    EXPECT_LT(moves[0].by.head<2>().norm(), 1e-6);
    EXPECT_LT(moves[0].by.z(), 0.3);
    world.check_start();
}

TEST(Start, ABodyThatIsStuckBetweenPlanesIsNotMended) {
    const Model box({0.4, 0.4, 0.4}, {2, 2, 2});
    World world(WorldConfig{.gravity = Eigen::Vector3d::Zero()});
    world.add_obstacle(floor_at(-0.1));
    world.add_obstacle({.shape = PlaneShape{.point = {0, 0, 0.1}, .normal = -Eigen::Vector3d::UnitZ()}});
    world.add_body(box.at({0, 0, 0}));
    EXPECT_NE(test::refusal([&] { world.resolve_start(); }).find("cannot be moved out of obstacles"),
              std::string::npos);
}

/// A tower on a floor, all parts of which touch.
TEST(Start, BodiesThatTouchAreMovedByLittle) {
    const Model box({0.1, 0.1, 0.1}, {2, 2, 2}, {.young = 1e6});
    World world(WorldConfig{});
    world.add_obstacle(floor_at(0));
    for (int k = 0; k < 3; ++k) world.add_body(box.at({0.013 * k, 0.007 * k, 0.05 + 0.1 * k}));
    EXPECT_NE(test::refusal([&] { world.check_start(); }), "");
    const std::vector<StartMove> moves = world.part_touching();
    ASSERT_EQ(moves.size(), 3u);
    for (const StartMove& move : moves) EXPECT_LT(move.by.norm(), 1.8e-3);
    for (int i = 0; i < 100; ++i) {
        const WorldReport report = world.step(5e-3);
        ASSERT_EQ(report.failure, "");
        EXPECT_LT(report.kinetic_energy, 0.01) << i;  // J; a fall by their size has three times 1 J
    }
    EXPECT_NEAR(test::centre_of_mass(world, 2)[2], 0.25, 3e-3);
}

TEST(Start, BodiesThatOverlapByMuchStayForTheUserToMove) {
    const Model box({0.1, 0.1, 0.1}, {2, 2, 2});
    World world(WorldConfig{});
    world.add_obstacle(floor_at(0));
    world.add_body(box.at({0, 0, 0.04}));
    const Nodes before = world.state(0).x;
    EXPECT_TRUE(world.part_touching().empty());
    EXPECT_EQ(world.state(0).x, before);
    EXPECT_NE(test::refusal([&] { world.step(5e-3); }).find("surfaces must start apart"), std::string::npos);
}

TEST(Start, BodiesThatAreApartAreNotMoved) {
    const Model box({0.1, 0.1, 0.1}, {2, 2, 2});
    World world(WorldConfig{});
    world.add_obstacle(floor_at(0));
    world.add_body(box.at({0, 0, 0.0502}));
    EXPECT_TRUE(world.part_touching().empty());
}

/// Else what presses would throw them. Also in empty space, and at all sizes.
TEST(Start, BodiesThatPressAreMovedToWhereTheyBeginTo) {
    for (const bool has_floor : {true, false})
        for (const double size : {0.1, 10.0}) {
            const Model box(make_rigid_body("box", test::box(size, size, size, 1), 1000));
            World world({.gravity = has_floor ? Eigen::Vector3d(0, 0, -9.81) : Eigen::Vector3d(0, 0, 0)});
            const double thickness = 1e-3 * std::sqrt(3.0) * size;
            for (const double z : {0.3 * thickness, size + 0.6 * thickness}) {
                WorldBody body = box.at({0, 0, z});
                world.add_body(std::move(body));
            }
            if (has_floor) world.add_obstacle(floor_at(0));
            ASSERT_NEAR(world.thickness(), thickness, 1e-6 * thickness);
            const std::vector<StartMove> moves = world.part_touching();
            ASSERT_EQ(moves.size(), 2u);
            for (const StartMove& move : moves) EXPECT_LT(move.by.norm(), 2 * thickness);
            const double start = test::centre_of_mass(world, 1)[2];
            for (int i = 0; i < 100; ++i) {
                ASSERT_EQ(world.step(1e-3).failure, "");
                ASSERT_LT(test::centre_of_mass(world, 1)[2], start + 0.5 * thickness) << size << ' ' << i;
            }
        }
}

/// Boxes of 20 cm, at these places.
std::vector<StartFault> faults_of(const std::vector<Eigen::Vector3d>& centres,
                                  const std::vector<Obstacle>& obstacles = {}) {
    const Model box({0.2, 0.2, 0.2}, {2, 2, 2});
    World world{WorldConfig{}};
    std::vector<std::string> labels;
    for (const Eigen::Vector3d& centre : centres)
        labels.push_back("box " + std::to_string(world.add_body(box.at(centre))));
    for (const Obstacle& obstacle : obstacles) world.add_obstacle(obstacle);
    return start_faults(world, labels);
}

void expect_one(const std::vector<StartFault>& faults, bool overlaps, const std::string& begin) {
    ASSERT_EQ(faults.size(), 1u);
    EXPECT_EQ(faults[0].overlaps, overlaps) << faults[0].text;
    EXPECT_TRUE(faults[0].text.starts_with(begin)) << faults[0].text;
}

Obstacle ball(const Eigen::Vector3d& centre, double radius) {
    return {.shape = BallShape{.centre = centre, .radius = radius}};
}

/// A solid box from `low` to `high`.
Obstacle block(const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
    const Model box(high - low, {2, 2, 2});
    TriMesh mesh = boundary_surface(box.body.tets);
    mesh.X.rowwise() += ((low + high) / 2 - mesh.X.colwise().mean().transpose()).transpose();
    return {.shape = std::make_shared<const StaticSurface>(std::move(mesh))};
}

TEST(StartCheck, FindsNothingBetweenThingsThatAreApart) {
    EXPECT_TRUE(faults_of({{0, 0, 0.11}, {0.201, 0, 0.11}, {0.05, 0.03, 0.3101}}, {floor_at(0)}).empty());
    EXPECT_TRUE(
        faults_of({{0, 0, 0}}, {ball({0, 0, 0.301}, 0.2), block({0.1001, -1, -1}, {1, 1, 1})}).empty());
}

TEST(StartCheck, TellsOverlapFromTouch) {
    expect_one(faults_of({{0, 0, 0}, {0.15, 0.02, 0.03}}), true, "box 1: overlaps box 0 at the start: ");
    expect_one(faults_of({{0, 0, 0}, {0.199, 0.02, 0.03}}), true, "box 1: overlaps box 0 at the start: ");
    expect_one(faults_of({{0, 0, 0}, {0.2, 0, 0}}), false, "box 1: touches box 0 at the start");
    expect_one(faults_of({{0, 0, 0}, {0.05, 0.07, -0.2}}), false, "box 1: touches box 0 at the start");
    // Far from the origin, where single precision knows no millimetre.
    const Eigen::Vector3d far(4e5, 5e6, 0);
    expect_one(faults_of({far, far + Eigen::Vector3d(0.15, 0, 0)}), true, "box 1: overlaps box 0");
    EXPECT_TRUE(faults_of({far, far + Eigen::Vector3d(0.21, 0, 0)}).empty());
}

TEST(StartCheck, FindsBodiesThatCrossWithoutAVertexInside) {
    const Model rod({1, 0.1, 0.1}, {4, 1, 1}), post({0.1, 0.1, 1}, {1, 1, 4});
    World world{WorldConfig{}};
    world.add_body(rod.at({0, 0, 0}));
    world.add_body(post.at({0.013, 0.007, 0.011}));
    expect_one(start_faults(world, {"rod", "post"}), true, "post: overlaps rod at the start: ");
}

TEST(StartCheck, FindsABodyInsideAnother) {
    const Model large({0.5, 0.5, 0.5}, {2, 2, 2}), small({0.1, 0.1, 0.1}, {1, 1, 1});
    World world{WorldConfig{}};
    world.add_body(large.at({0, 0, 0}));
    world.add_body(small.at({0.03, 0.02, 0.01}));
    expect_one(start_faults(world, {"large", "small"}), true,
               "small: lies inside large or encloses it at the start");
}

TEST(StartCheck, FindsBodiesInObstacles) {
    expect_one(faults_of({{0, 0, 0.07}}, {floor_at(0)}), true,
               "box 0: is 0.03 m deep in obstacles[0] at the");
    expect_one(faults_of({{0, 0, 0.1}}, {floor_at(0)}), false, "box 0: touches obstacles[0] at the start");
    expect_one(faults_of({{0, 0, 0.0999}}, {floor_at(0)}), false, "box 0: touches obstacles[0] at the start");
    // A ball that comes through a face between its vertices, one wholly inside, one that touches.
    expect_one(faults_of({{0, 0, 0}}, {ball({0.05, 0.05, 0.13}, 0.04)}), true, "box 0: is 0.01 m deep in");
    expect_one(faults_of({{0, 0, 0}}, {ball({0.01, 0.02, 0}, 0.02)}), true, "box 0: is 0.1 m deep in");
    expect_one(faults_of({{0, 0, 0}}, {ball({0.05, 0.05, 0.14}, 0.04)}), false,
               "box 0: touches obstacles[0]");
    // Meshes: a vertex inside, faces that cross without one, a mesh inside, one that touches.
    expect_one(faults_of({{0, 0, 0}}, {block({0.05, 0.05, -1}, {1, 1, 1})}), true,
               "box 0: is 0.05 m deep in");
    expect_one(faults_of({{0, 0, 0}}, {block({0.02, 0.02, -1}, {0.08, 0.07, 1})}), true,
               "box 0: overlaps obstacles[0] at the start: ");
    expect_one(faults_of({{0, 0, 0}}, {block({-0.03, -0.03, -0.05}, {0.03, 0.02, 0.05})}), true,
               "box 0: encloses obstacles[0] at the start");
    expect_one(faults_of({{0, 0, 0}}, {block({0.1, -1, -1}, {1, 1, 1})}), false,
               "box 0: touches obstacles[0]");
}

TEST(StartCheck, WarnsInOneLine) {
    EXPECT_EQ(start_warning({}, false), "");
    const StartFault fault{.overlaps = true,
                           .text = "b: overlaps a",
                           .way = "; \"resolve_start\": true moves bodies apart before the first step"};
    EXPECT_EQ(start_warning({fault}, false),
              "b: overlaps a; \"resolve_start\": true moves bodies apart before the first step");
    EXPECT_EQ(start_warning({fault, fault, fault, fault, fault}, true),
              "b: overlaps a; b: overlaps a; b: overlaps a; and 2 more, although \"resolve_start\" is set; "
              "place the bodies apart");
    // Overlaps come first.
    const auto faults = faults_of({{0, 0, 0.1}, {1, 0, 0.05}}, {floor_at(0)});
    ASSERT_EQ(faults.size(), 2u);
    EXPECT_TRUE(faults[0].overlaps);
    EXPECT_TRUE(faults[0].text.starts_with("box 1: is 0.05 m deep")) << faults[0].text;
}

}  // namespace
}  // namespace nbd
