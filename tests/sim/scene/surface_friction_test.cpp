// Friction of parts of a body's surface.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "meshing/body/rigid_body.hpp"
#include "sim/scene/scene.hpp"
#include "tests/sim/scene/scene_text.hpp"
#include "tests/support/box_body.hpp"
#include "tests/support/error_of.hpp"

namespace nbd {
namespace {

using test::complaint;
using test::with;

/// A flat rigid block; its base has rows of vertices at y = -0.06, -0.03, 0, 0.03 and 0.06.
LoadedBody flat_block() {
    return {std::make_shared<const Body>(
                make_rigid_body("block", test::box_body({0.4, 0.12, 0.02}, {12, 4, 1}).surface, 1000)),
            nullptr};
}

/// Rows of the base on both sides of the middle, with another friction.
const std::string two_rows =
    R"({"any": [{"box": {"min": [-1, -0.04, -1], "max": [1, -0.02, 1]}},
                {"box": {"min": [-1, 0.02, -1], "max": [1, 0.04, 1]}}]})";

struct Slope {
    std::string friction;           // key of the body
    std::string obstacle_friction;  // key of the floor, or pairs
    double tangent = 0;             // of the slope
    bool is_mesh = false;           // whether the floor is a mesh, not a plane
    double dt = 0.004;
};

/// How far the block has slid on a slope after half a second, and its speed. The slope is gravity's. The
/// block begins a tenth of a millimetre above it, so that it slides where it lands, until friction stops it.
std::pair<double, double> slid(const Slope& slope, const std::string& contact = "{}") {
    const double length = std::hypot(1, slope.tangent), g = 9.81;
    const std::string floor = slope.is_mesh
                                  ? R"("box": {"size": [4, 4, 1], "transform": {"translate": [0, 0, -0.5]}})"
                                  : R"("plane": {})";
    const std::string text = fmt::format(
        R"({{"bodies": [{{"body": "block.h5", "name": "block", "transform": {{"translate": [0, 0, 0.0101]}}, {}}}],
            "obstacles": [{{"name": "floor", {}, {}}}], "contact": {},
            "gravity": [{}, 0, {}], "solver": {{"integrator": "backward_euler"}}}})",
        slope.friction, floor, slope.obstacle_friction, contact, g * slope.tangent / length, -g / length);
    const LoadedBody loaded = flat_block();
    World world = build_world(parse_scene(text, ""), std::span(&loaded, 1));
    const double start = world.state(0).x.col(0).mean();
    for (double time = 0; time < 0.5 - 1e-9; time += slope.dt) EXPECT_EQ(world.step(slope.dt).failure, "");
    return {world.state(0).x.col(0).mean() - start, world.state(0).v.col(0).mean()};
}

/// Share of the base's area that the two rows carry, as contact weighs vertices.
double share_of_two_rows() {
    const Body block = *flat_block().body;
    const ContactShape shape(block.W, block.surface.F, block.tets.X);
    double base = 0, rows = 0;
    for (int v = 0; v < block.surface.X.rows(); ++v) {
        if (block.surface.X(v, 2) > 0) continue;
        base += shape.rest_areas[v];
        if (std::abs(std::abs(block.surface.X(v, 1)) - 0.03) < 1e-9) rows += shape.rest_areas[v];
    }
    return rows / base;
}

TEST(SurfaceFriction, ABlockWithASlipperyPartOfItsBaseSlidesAtTheMeanOfBoth) {
    const double share = share_of_two_rows();
    ASSERT_GT(share, 0.3);
    ASSERT_LT(share, 0.6);
    const double rough = 0.6, slippery = 0.1, mean = share * slippery + (1 - share) * rough;
    for (const double dt : {0.004, 0.01}) {
        Slope slope{.friction = R"("friction": [{"region": )" + two_rows + R"(, "coefficient": 0.1}])",
                    .obstacle_friction = R"("friction": 0.6)",
                    .dt = dt};
        slope.tangent = 0.97 * mean;
        EXPECT_LT(std::abs(slid(slope).second), 1e-4) << "it holds";
        slope.tangent = 1.03 * mean;
        EXPECT_GT(slid(slope).second, 0.02) << "it slides";
        slope.tangent = 2 * mean;
        const double a = 9.81 * mean / std::hypot(1, slope.tangent);  // (tangent - mean) cos
        EXPECT_NEAR(slid(slope).second, 0.5 * a, 0.01 * a);
    }
}

TEST(SurfaceFriction, OfTheWholeSurfaceTakesThePlaceOfTheObstacles) {
    for (const bool is_mesh : {false, true}) {
        Slope slope{.friction = R"("friction": [{"coefficient": 0.2}])",
                    .obstacle_friction = R"("friction": 0.9)",
                    .tangent = 0.19,
                    .is_mesh = is_mesh};
        EXPECT_LT(std::abs(slid(slope).second), 1e-4) << is_mesh;
        slope.tangent = 0.21;
        EXPECT_GT(slid(slope).second, 0.02) << is_mesh;
        slope.friction = R"("friction": [{"coefficient": 0.9}])";
        slope.obstacle_friction = R"("friction": 0)";
        slope.tangent = 0.8;
        EXPECT_LT(std::abs(slid(slope).second), 1e-4) << "a tread grips also where the floor is smooth";
    }
}

TEST(SurfaceFriction, OfARuleForThePairComesFirst) {
    const Slope slope{.friction = R"("friction": [{"coefficient": 0}])",
                      .obstacle_friction = R"("friction": 0)",
                      .tangent = 0.3};
    EXPECT_GT(slid(slope).first, 0.1);
    const std::string rule = R"({"pairs": [{"body": "block", "obstacle": "floor", "friction": 0.35}]})";
    EXPECT_LT(std::abs(slid(slope, rule).second), 1e-4);
}

TEST(SurfaceFriction, OfTwoSurfacesTheSmallerHolds) {
    const auto slides = [](const std::string& lower, const std::string& upper, double usual = 1) {
        const std::string text = fmt::format(
            R"({{"bodies": [{{"body": "a.h5", "name": "lower", "friction": [{{"coefficient": {}}}],
                              "pins": [{{"box": {{"min": [-9, -9, -9], "max": [9, 9, 9]}}}}]}},
                            {{"body": "b.h5", "transform": {{"translate": [0, 0, 0.0201]}}, {}}}],
                "gravity": [2.943, 0, -9.81], "contact": {{"friction": {}}},
                "solver": {{"integrator": "backward_euler"}}}})",
            lower, upper, usual);
        const std::vector<LoadedBody> loaded{flat_block(), flat_block()};
        World world = build_world(parse_scene(text, ""), loaded);
        const double start = world.state(1).x.col(0).mean();
        for (int i = 0; i < 50; ++i) EXPECT_EQ(world.step(0.004).failure, "");
        return world.state(1).x.col(0).mean() - start > 1e-3;
    };
    EXPECT_TRUE(slides("0.2", R"("friction": [{"coefficient": 0.5}])"));
    EXPECT_TRUE(slides("0.5", R"("friction": [{"coefficient": 0.2}])"));
    EXPECT_FALSE(slides("0.5", R"("friction": [{"coefficient": 0.4}])"));
    EXPECT_TRUE(slides("0.2", R"("name": "plain")"));
    EXPECT_FALSE(slides("0.4", R"("name": "plain")"));
    // About a part with its own, and beyond it, the other surface's counts, not the usual one.
    const std::string rows = R"("friction": [{"region": )" + two_rows + R"(, "coefficient": 0.35}])";
    EXPECT_FALSE(slides("0.35", rows, 0.05));
    EXPECT_TRUE(slides("0.25", rows, 0.05));
}

TEST(SurfaceFriction, OfTwoRegionsForAVertexTheLaterHolds) {
    const std::string all =
        R"({"coefficient": 0.9}, {"region": {"box": {"min": [-9, -9, -9], "max": [9, 9, 9]}}, "coefficient": 0.1})";
    const Slope slope{.friction = R"("friction": [)" + all + "]",
                      .obstacle_friction = R"("friction": 0.9)",
                      .tangent = 0.2};
    EXPECT_GT(slid(slope).first, 1e-3);
}

TEST(SurfaceFriction, IsRefusedWhereItIsWrong) {
    const std::string at = "bodies[0].friction[0]";
    EXPECT_EQ(complaint(with(R"("friction": [{}])")), at + ".coefficient: is missing");
    EXPECT_EQ(complaint(with(R"("friction": [{"coefficient": -1}])")),
              at + ".coefficient: is -1, but must be between 0 and 10");
    EXPECT_EQ(complaint(with(R"("friction": [{"coefficient": 1, "region": {}}])"))
                  .find(at + ".region: needs exactly one of"),
              0u);
    const LoadedBody loaded = flat_block();
    EXPECT_EQ(test::error_of([&] {
                  build_world(parse_scene(with(R"("friction": [{"coefficient": 1, "region":
                      {"sphere": {"centre": [5, 0, 0], "radius": 1}}}])"),
                                          ""),
                              std::span(&loaded, 1));
              }),
              "bodies[0] (a): friction[0].region: holds no vertex of the body's surface");
}

}  // namespace
}  // namespace nbd
