// What is held may touch at the start: obstacles, and other bodies that are held.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "meshing/body/make_body.hpp"
#include "sim/world/world.hpp"
#include "tests/sim/world/box_model.hpp"
#include "tests/support/box_body.hpp"
#include "tests/support/box_mesh.hpp"
#include "tests/support/error_of.hpp"

namespace nbd {
namespace {

using test::floor_at;
using test::Model;

/// A place of a world, and a size of what is in it, metres.
struct Scale {
    double size;
    Eigen::Vector3d origin;
};

const Scale scales[] = {
    {0.01, {0, 0, 0}}, {1, {0, 0, 0}}, {100, {0, 0, 0}}, {0.01, {6e5, -5e5, 7e5}}, {1, {6e5, -5e5, 7e5}}};

/// A grip of the nodes less than a thousandth of the size above the lowest one.
Grip lowest(const WorldBody& body, double size) {
    const double low = body.state.x.col(2).minCoeff();
    return {.nodes = test::nodes_where(body.state.x,
                                       [&](const Eigen::Vector3d& x) { return x.z() < low + 1e-3 * size; })};
}

/// A bar of 1 x 0.4 x 0.3 sizes that stands on z = 0 of the origin.
Model bar_of(double size) {
    return Model(size * Eigen::Vector3d(1, 0.4, 0.3), {5, 2, 2}, {.young = 1e5 * size});
}

WorldBody standing(const Model& bar, const Scale& scale) {
    WorldBody body = bar.at(scale.origin + scale.size * Eigen::Vector3d(0, 0, 0.15));
    const double low = scale.origin.z();
    for (Eigen::Index i = 0; i < body.state.x.rows(); ++i)  // exactly
        if (body.state.x(i, 2) < low + 1e-3 * scale.size) body.state.x(i, 2) = low;
    return body;
}

/// A solid block of 4 x 4 x 1 sizes below z = 0 of the origin.
Obstacle ground(const Scale& scale) {
    const Model block(scale.size * Eigen::Vector3d(4, 4, 1), {7, 7, 2});
    TriMesh mesh = boundary_surface(block.body.tets);
    mesh.X.rowwise() -= mesh.X.colwise().mean();
    mesh.X.col(2).array() -= mesh.X.col(2).maxCoeff();
    mesh.X.rowwise() += scale.origin.transpose();
    return {.shape = std::make_shared<const StaticSurface>(std::move(mesh))};
}

/// Steps of a fall by a hundredth of the size, none of which fails or intersects.
void take_steps(World& world, const Scale& scale, int steps) {
    const double dt = 0.05 * std::sqrt(scale.size / 9.81);
    for (int i = 0; i < steps; ++i) {
        const WorldReport report = world.step(dt);
        ASSERT_EQ(report.failure, "") << i;
        ASSERT_TRUE(world.intersecting_faces().empty()) << i;
    }
}

class HeldStart : public testing::TestWithParam<Scale> {};

TEST_P(HeldStart, ABodyPinnedOnAPlaneKeepsTheRestOfItAbove) {
    const Scale& scale = GetParam();
    const Model bar = bar_of(scale.size);
    World world(WorldConfig{});
    const double z = scale.origin.z();
    world.add_obstacle(floor_at(z));
    WorldBody body = standing(bar, scale);
    // One end of it; the other is lifted, so that it falls on the plane.
    Grip pin = lowest(body, scale.size);
    std::erase_if(pin.nodes,
                  [&](int i) { return body.state.x(i, 0) > scale.origin.x() - 0.25 * scale.size; });
    ASSERT_GT(pin.nodes.size(), 4u);
    for (Eigen::Index i = 0; i < body.state.x.rows(); ++i)
        body.state.x(i, 2) += 0.1 * std::max(body.state.x(i, 0) - scale.origin.x() + 0.3 * scale.size, 0.0);
    body.grips = {pin};
    world.add_body(std::move(body));
    const Nodes held = world.state(0).x(pin.nodes, Eigen::all);
    ASSERT_EQ(held.col(2).minCoeff(), z);
    take_steps(world, scale, 60);
    EXPECT_LT((world.state(0).x(pin.nodes, Eigen::all) - held).cwiseAbs().maxCoeff(), 1e-6 * scale.size);
    Nodes others = world.state(0).x;
    others(pin.nodes, 2).setConstant(z + scale.size);
    EXPECT_GT(others.col(2).minCoeff(), z);
    EXPECT_LT(others.col(2).minCoeff(), z + 2 * world.thickness()) << "it lies on the plane";
}

TEST_P(HeldStart, ABodyGluedToAMeshOrToABodyRuns) {
    const Scale& scale = GetParam();
    const Model bar = bar_of(scale.size);
    for (const bool on_body : {false, true}) {
        World world(WorldConfig{.gravity = {9.81, 0, 0}});  // shears it
        if (on_body) {
            WorldBody below = bar.at(scale.origin - scale.size * Eigen::Vector3d(0.1, 0.03, 0.15));
            Grip all;
            for (int i = 0; i < below.state.x.rows(); ++i) all.nodes.push_back(i);
            below.grips = {all};
            world.add_body(std::move(below));
        } else {
            world.add_obstacle(ground(scale));
        }
        WorldBody body = standing(bar, scale);
        body.grips = {lowest(body, scale.size)};
        const Nodes start = body.state.x;
        const int glued = world.add_body(std::move(body));
        EXPECT_EQ(test::refusal([&] { world.check_start(); }), "");
        take_steps(world, scale, 20);
        const double moved = (world.state(glued).x - start).cwiseAbs().maxCoeff();
        EXPECT_GT(moved, 0.01 * scale.size);
        EXPECT_GT(world.state(glued).x.col(2).minCoeff(), scale.origin.z() - 1e-6 * scale.size);
    }
}

INSTANTIATE_TEST_SUITE_P(Sizes, HeldStart, testing::ValuesIn(scales));

TEST(HeldStartGrip, MayLeaveAPlaneThatItTouches) {
    const Scale scale{1, {0, 0, 0}};
    const Model bar = bar_of(1);
    World world(WorldConfig{});
    world.add_obstacle(floor_at(0));
    WorldBody body = standing(bar, scale);
    Grip lift = lowest(body, 1);
    lift.motion = eased({.translation = {0, 0, 0.2}, .duration = 0.3});
    lift.release = 0.6;
    body.grips = {lift};
    world.add_body(std::move(body));
    double highest = 0;
    for (int i = 0; i < 300; ++i) {
        ASSERT_EQ(world.step(5e-3).failure, "");
        highest = std::max(highest, world.surface(0).col(2).minCoeff());
    }
    EXPECT_NEAR(highest, 0.2, 1e-3);
    EXPECT_GT(world.surface(0).col(2).minCoeff(), -world.thickness()) << "the plane carries it again";
    EXPECT_LT(world.surface(0).col(2).minCoeff(), 0.01);
}

TEST(HeldStartGrip, DoesNotGoIntoAPlaneThatItTouches) {
    const Scale scale{1, {0, 0, 0}};
    World world(WorldConfig{});
    world.add_obstacle(floor_at(0));
    const Model bar = bar_of(1);
    WorldBody body = standing(bar, scale);
    Grip push = lowest(body, 1);
    push.motion = eased({.translation = {0, 0, -0.2}, .duration = 0.3});
    body.grips = {push};
    world.add_body(std::move(body));
    WorldReport report;
    for (int i = 0; i < 60 && report.failure.empty(); ++i) report = world.step(5e-3);
    EXPECT_NE(report.failure.find("grips and obstacles cannot go"), std::string::npos) << report.failure;
    EXPECT_GT(world.surface(0).col(2).minCoeff(), -world.thickness());
}

TEST(HeldStartRefusal, SaysHowFarAwayToPlaceWhatIsHeld) {
    const Model bar = bar_of(1);
    World in_floor(WorldConfig{});
    in_floor.add_obstacle(floor_at(0.05));
    WorldBody pinned = standing(bar, {1, {0, 0, 0}});
    pinned.grips = {{.nodes = {0}}};
    in_floor.add_body(pinned);
    const std::string said = test::refusal([&] { in_floor.check_start(); });
    EXPECT_NE(said.find("; body 0 is held, so place it at least 0.0011 m away"), std::string::npos) << said;
    EXPECT_EQ(said.find("resolve_start"), std::string::npos) << said;

    // It touches where it is not held.
    World touching(WorldConfig{});
    touching.add_obstacle(floor_at(0));
    touching.add_body(pinned);
    EXPECT_NE(test::refusal([&] { touching.check_start(); }).find("body 0 is held, so place it at least"),
              std::string::npos);

    // Two bodies of which a grip lets one go.
    World two(WorldConfig{});
    WorldBody upper = standing(bar, {1, {0, 0, 0}}), lower = bar.at({0.1, 0.03, -0.15});
    upper.grips = {lowest(upper, 1)};
    upper.grips[0].release = 1;
    lower.grips = {lowest(lower, 1)};
    two.add_body(upper);
    two.add_body(lower);
    EXPECT_NE(test::refusal([&] {
                  two.check_start();
              }).find("; bodies 0 and 1 are held, so place them at least 0.0011 m apart"),
              std::string::npos);
    EXPECT_NE(test::refusal([&] { two.resolve_start(); }), "");
}

TEST(HeldStartResolve, LeavesWhatIsHeldWhereItTouches) {
    const Model bar = bar_of(1);
    for (const bool on_mesh : {false, true}) {
        const Scale scale{1, {0, 0, 0}};
        World world(WorldConfig{});
        world.add_obstacle(on_mesh ? ground(scale) : floor_at(0));
        WorldBody body = standing(bar, scale);
        body.grips = {lowest(body, 1)};
        world.add_body(std::move(body));
        world.add_body(bar.at({0.1, 0.1, 0.4}));  // in the first one
        const std::vector<StartMove> moves = world.resolve_start();
        ASSERT_EQ(moves.size(), 1u);
        EXPECT_EQ(moves[0].body, 1);
        take_steps(world, scale, 5);
    }
}

}  // namespace
}  // namespace nbd
