#include "sim/world/start_check.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "meshing/body/make_body.hpp"
#include "tests/sim/world/box_model.hpp"

namespace nbd {
namespace {

using test::floor_at;
using test::Model;

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
    const StartFault fault{true, "b: overlaps a"};
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
