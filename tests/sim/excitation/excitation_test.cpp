#include "sim/excitation/excitation.hpp"

#include <gtest/gtest.h>

#include <Eigen/SVD>
#include <algorithm>
#include <set>
#include <thread>
#include <vector>

#include "tests/support/box_body.hpp"
#include "tests/support/error_of.hpp"

namespace nbd {
namespace {

using test::error_of;

Body bar() { return test::box_body({1, 0.3, 0.25}, {6, 2, 2}); }

ExcitationConfig short_run() { return {.frames = 12, .seed = 7}; }

RecipeBook bar_recipes(const ExcitationConfig& config = short_run()) {
    return {std::make_shared<const Body>(bar()), config};
}

struct Watched {
    TrajectoryResult result;
    std::vector<double> times;
    std::vector<Nodes> frames;
};

Watched run(const Excitation& excitation, int index) {
    Watched out;
    out.result = excitation.run(index, [&](const ExcitedFrame& frame) {
        out.times.push_back(frame.time);
        out.frames.push_back(frame.x);
    });
    return out;
}

/// Largest magnitude of a principal strain in a frame.
double strain(const ElasticBody& body, const Nodes& x) {
    double largest = 0;
    for (int t = 0; t < body.element_count(); ++t) {
        const Eigen::JacobiSVD<Eigen::Matrix3d> svd(body.deformation_gradient(x, t));
        largest = std::max(largest, (svd.singularValues().array() - 1).abs().maxCoeff());
    }
    return largest;
}

TEST(Excitation, AMuchFinerSurfaceMakesContactByTheTetrahedrasBoundary) {
    const Body fine = test::fine_box_body({1, 0.3, 0.25}, {6, 2, 2}, 2);
    ExcitationConfig config = short_run();
    const Excitation by_boundary(fine, config);
    config.own_surface = true;
    const Excitation by_surface(fine, config);
    EXPECT_EQ(by_surface.start(0).shape(0).vertex_count(), fine.W.rows());
    EXPECT_EQ(by_boundary.start(0).shape(0).vertex_count(), bar().W.rows());
    EXPECT_EQ(Excitation(bar(), {}).start(0).shape(0).vertex_count(), bar().W.rows());
    // Nothing but contact depends on it.
    for (int index = 0; index < 10; ++index) EXPECT_EQ(by_boundary.recipe(index), by_surface.recipe(index));
}

TEST(Recipe, AlternatesKindsAndDrawsNumbersFromTheIndex) {
    const RecipeBook recipes = bar_recipes();
    std::set<RecipeKind> kinds;
    std::set<std::string> texts;
    for (int i = 0; i < 10; ++i) {
        const Recipe recipe = recipes.draw(i);
        kinds.insert(recipe.kind);
        texts.insert(recipe_json(recipe));
    }
    EXPECT_EQ(kinds.size(), 5u);
    EXPECT_EQ(texts.size(), 10u);
}

TEST(RecipeObstacles, AreReadFromTheTextThatATrajectoryKeeps) {
    ExcitationConfig config = short_run();
    config.ranges.kinds[int(RecipeKind::squash)].weight = 1;
    const RecipeBook recipes = bar_recipes(config);
    int floors = 0, plates = 0;
    for (int i = 0; i < 12; ++i) {
        const Recipe recipe = recipes.draw(i);
        const std::vector<Obstacle> known = recipe_obstacles(recipe),
                                    read = recipe_obstacles(recipe_json(recipe));
        ASSERT_EQ(read.size(), known.size());
        EXPECT_EQ(known.size(), recipe.plates.size() + (recipe.floor ? 1 : 0));
        floors += recipe.floor ? 1 : 0;
        plates += recipe.plates.size();
        for (std::size_t k = 0; k < known.size(); ++k) {
            EXPECT_EQ(std::get<PlaneShape>(read[k].shape).point, std::get<PlaneShape>(known[k].shape).point);
            EXPECT_EQ(std::get<PlaneShape>(read[k].shape).normal,
                      std::get<PlaneShape>(known[k].shape).normal);
            for (const double time : {0.3, 1e9})
                EXPECT_EQ(read[k].motion.at(time).translation, known[k].motion.at(time).translation);
        }
    }
    EXPECT_GT(floors, 0);
    EXPECT_GT(plates, 0);
}

TEST(RecipeObstacles, OtherTextsHaveNoneAndDamagedOnesAreRefused) {
    for (const char* text : {"", "{}", "[]", "not json", R"({"floor": 1})", R"({"bodies": []})"})
        EXPECT_TRUE(recipe_obstacles(text).empty()) << text;
    for (const char* text : {R"({"kind": "drop", "floor": "low"})", R"({"kind": "squash", "plates": 3})",
                             R"({"kind": "squash", "plates": [{"point": [0, 0]}]})"})
        EXPECT_TRUE(error_of([&] {
                        recipe_obstacles(text);
                    }).starts_with("the obstacles of its recipe cannot be read: "))
            << text;
    EXPECT_NE(
        error_of([] {
            recipe_obstacles(
                R"({"kind": "squash", "plates": [{"point": [0, 0, 0], "normal": [0, 0, 2], "speed": 1, "stop": 1}]})");
        }),
        "");
}

TEST(Excitation, EveryKindOfRecipeCompletesAndDeformsTheBody) {
    const Body body = bar();
    const ElasticBody elastic(body.tets, body.material);
    const Excitation excitation(body, short_run());
    int complete = 0, visible = 0;
    for (int i = 0; i < 15; ++i) {
        const Watched trajectory = run(excitation, i);
        ASSERT_EQ(trajectory.frames.size(), static_cast<std::size_t>(trajectory.result.frames));
        if (!trajectory.result.failure.empty()) continue;
        EXPECT_EQ(trajectory.result.frames, 12);
        ++complete;
        double largest = 0;
        for (const Nodes& x : trajectory.frames) {
            ASSERT_TRUE(x.allFinite());
            largest = std::max(largest, strain(elastic, x));
        }
        EXPECT_GT(largest, 0.02) << excitation.recipe(i);
        if (largest > 0.15) ++visible;
        for (std::size_t f = 1; f < trajectory.times.size(); ++f)
            EXPECT_NEAR(trajectory.times[f] - trajectory.times[f - 1], bar_recipes().frame_interval(), 1e-12);
    }
    EXPECT_GE(complete, 14);
    EXPECT_GE(visible, 8);
}

/// Only one kind of trajectories.
ExcitationConfig only(RecipeKind kind) {
    ExcitationConfig config = short_run();
    config.frames = 30;
    for (KindRanges& ranges : config.ranges.kinds) ranges.weight = 0;
    config.ranges.kinds[int(kind)].weight = 1;
    return config;
}

/// Longest side of the box around the nodes, relative to that at rest, at the end of a trajectory.
double length_at_end(const Body& body, const ExcitationConfig& config) {
    const Watched trajectory = run(Excitation(body, config), 0);
    EXPECT_EQ(trajectory.result.failure, "");
    const Nodes &X = body.tets.X, &x = trajectory.frames.back();
    // Farthest pair of nodes: independent of the rotation.
    const auto extent = [](const Nodes& nodes) {
        double most = 0;
        for (Eigen::Index i = 0; i < nodes.rows(); ++i)
            most = std::max(most, (nodes.rowwise() - nodes.row(i)).rowwise().norm().maxCoeff());
        return most;
    };
    return extent(x) / extent(X);
}

TEST(Excitation, FoldsAndCurlsBringTheEndsTogether) {
    const Body rod = test::box_body({1, 0.08, 0.08}, {12, 1, 1});
    EXPECT_LT(length_at_end(rod, only(RecipeKind::fold)), 0.7);
    EXPECT_LT(length_at_end(rod, only(RecipeKind::curl)), 0.8);
}

TEST(Excitation, PlatesPressTheBodyFlat) {
    const ExcitationConfig config = only(RecipeKind::squash);
    const Recipe recipe = bar_recipes(config).draw(0);
    ASSERT_EQ(recipe.plates.size(), 2u);
    const auto apart = [&](double time) {
        double height[2];
        for (int p = 0; p < 2; ++p) {
            const Plate& plate = recipe.plates[p];
            height[p] = plate.point.z() + plate.normal.z() * plate.speed * time;
        }
        return height[1] - height[0];
    };
    const double stop = recipe.plates[0].stop;
    EXPECT_LT(apart(stop), 0.75 * apart(0));
    const Watched trajectory = run(Excitation(bar(), config), 0);
    ASSERT_EQ(trajectory.result.failure, "");
    ASSERT_GT(trajectory.times.back(), stop);
    const auto z = trajectory.frames.back().col(2);
    EXPECT_LT(z.maxCoeff() - z.minCoeff(), 1.03 * apart(stop));
    EXPECT_GT(z.maxCoeff() - z.minCoeff(), 0.9 * apart(stop));
}

TEST(Excitation, FramesAreBitIdenticalAloneAndInParallel) {
    const Excitation excitation(bar(), short_run());
    std::vector<Watched> alone, beside(5);
    for (int i = 0; i < 5; ++i) alone.push_back(run(excitation, i));
    std::vector<std::thread> threads;
    for (int i = 0; i < 5; ++i) threads.emplace_back([&, i] { beside[i] = run(excitation, i); });
    for (std::thread& thread : threads) thread.join();
    for (std::size_t i = 0; i < 5; ++i) {
        ASSERT_EQ(alone[i].frames.size(), 12u);
        ASSERT_EQ(alone[i].frames.size(), beside[i].frames.size());
        for (std::size_t f = 0; f < alone[i].frames.size(); ++f)
            EXPECT_TRUE(alone[i].frames[f] == beside[i].frames[f]) << "trajectory " << i << " frame " << f;
    }
}

TEST(Excitation, AdaptsToSizeStiffnessAndDensity) {
    Material jelly{.young = 3e3, .density = 1100};
    const Body small = test::box_body({1e-2, 3e-3, 2.5e-3}, {6, 2, 2}, jelly);
    const Body large = test::box_body({100, 30, 25}, {6, 2, 2}, {.young = 1e9, .density = 7800});
    for (const Body& body : {small, large}) {
        const ElasticBody elastic(body.tets, body.material);
        const Excitation excitation(body, short_run());
        double largest = 0;
        for (int i = 0; i < 5; ++i)
            for (const Nodes& x : run(excitation, i).frames) largest = std::max(largest, strain(elastic, x));
        EXPECT_GT(largest, 0.15);
        EXPECT_LT(largest, 2);
    }
}

TEST(Excitation, MarksExtremeTrajectoriesAsFailedWithAReason) {
    ExcitationConfig config = short_run();
    config.ranges.strength = 60;
    const Excitation excitation(bar(), config);
    int failed = 0;
    for (int i = 0; i < 5; ++i) {
        const Watched trajectory = run(excitation, i);
        for (const Nodes& x : trajectory.frames) EXPECT_TRUE(x.allFinite());
        if (trajectory.result.failure.empty()) continue;
        ++failed;
        EXPECT_LT(trajectory.result.frames, 12);
        EXPECT_NE(trajectory.result.failure.find("tetrahedr"), std::string::npos)
            << trajectory.result.failure;
        EXPECT_EQ(trajectory.result.failure.find('\n'), std::string::npos);
        EXPECT_EQ(trajectory.result.failure.rfind("at ", 0), 0u) << trajectory.result.failure;
    }
    EXPECT_GE(failed, 3);
}

TEST(Excitation, ThinBodiesCompleteWithDefaults) {
    const Excitation excitation(test::box_body({1, 0.04, 0.04}, {30, 1, 1}), short_run());
    for (int i = 0; i < 10; ++i) EXPECT_EQ(run(excitation, i).result.failure, "") << i;
}

TEST(Excitation, SmallerStepsKeepTheFrames) {
    const Excitation excitation(bar(), short_run());
    const Watched coarse = run(excitation, 1);
    std::vector<double> times;
    const TrajectoryResult fine = excitation.run(
        1, [&](const ExcitedFrame& frame) { times.push_back(frame.time); }, 8);
    EXPECT_EQ(fine.frames, coarse.result.frames);
    ASSERT_EQ(times.size(), 12u);
    for (std::size_t i = 1; i < times.size(); ++i)
        EXPECT_NEAR(times[i] - times[i - 1], bar_recipes().frame_interval(), 1e-12);
}

TEST(Excitation, RejectsNumbersOutOfRange) {
    const auto message = [](const ExcitationConfig& config) {
        return test::refusal([&] { Excitation(bar(), config); });
    };
    EXPECT_EQ(message({.frames = 0}), "excitation: frames is 0, but must be > 0");
    EXPECT_EQ(message({.frame_interval = -1}), "excitation: frame_interval is -1, but must be >= 0");
    EXPECT_EQ(message({.steps_per_frame = 0}), "excitation: steps_per_frame is 0, but must be > 0");
    EXPECT_EQ(message({.ranges = {.strength = -2}}), "excitation: strength is -2, but must be > 0");
    const std::string too_long = message({.frames = 5, .frame_interval = 1e6});
    EXPECT_EQ(too_long.rfind("excitation: 5 frames of 1e+06 s after a warm-up of ", 0), 0u) << too_long;
    EXPECT_NE(too_long.find(" s last 5e+06 s; allowed: at most "), std::string::npos) << too_long;
    EXPECT_EQ(message({.frames = 1'000'000}), "");  // at the default interval
    EXPECT_NE(message({.ranges = {.warm_up = {0, 1e6}}}), "");
}

}  // namespace
}  // namespace nbd
