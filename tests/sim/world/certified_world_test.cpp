// Tests the region motions that the simulator passes to `certified` bounds.
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>

#include "collision/bounds/certified/build_certified_model.hpp"
#include "collision/bounds/certified/solid_meter.hpp"
#include "sim/world/world.hpp"
#include "tests/sim/world/box_model.hpp"
#include "tests/support/box_mesh.hpp"
#include "tests/support/on_threads.hpp"

namespace nbd {
namespace {

using test::Model;

std::shared_ptr<const CollisionTree> certified_tree(const Body& body) {
    auto tree = std::make_shared<CollisionTree>(
        make_exact_tree(body.surface.X.cast<float>(), body.surface.F, {.depth = 5, .min_leaf_faces = 2}));
    tree->certified = build_certified_model(tree->spheres, tree->faces, body.tets, body.W.cast<float>(),
                                            {.anchors = 12, .regions = {.splits = 0}});
    return tree;
}

TEST(RegionMotions, OfTheSimulatorAgreeWithMeasurementsFromPositions) {
    const Model box({1, 0.4, 0.3}, {7, 3, 2});
    const auto tree = certified_tree(box.body);
    const auto regions = std::make_shared<const TetRegions>(tree->certified->regions);
    const ElasticBody elastic(box.body.tets, box.body.material);
    const Nodes x = box.body.tets.X + test::wild_field(box.body.tets.X, 0.02);
    SolidMeter expected(box.body.tets, regions);
    const Vertices rounded = x.cast<float>();
    const std::span<const RegionMotion> measured = expected.measure(rounded);
    std::vector<RegionMotion> first;
    float largest = 0;
    const double energy = elastic.measure(x).energy;
    for (const int threads : {1, 4}) {
        RegionMeter meter(regions, elastic.element_count());
        test::on_threads(threads, [&] {
            EXPECT_EQ(elastic.measure(x, &meter).energy, energy);  // the meter has no side effects
            return 0;
        });
        ASSERT_EQ(meter.motions().size(), measured.size());
        for (std::size_t r = 0; r < measured.size(); ++r) {
            EXPECT_NEAR(meter.motions()[r].stretch, measured[r].stretch, 1e-5);
            EXPECT_NEAR(meter.motions()[r].deviation, measured[r].deviation, 1e-5);
            EXPECT_LT((meter.motions()[r].G - measured[r].G).norm(), 1e-5);
            largest = std::max(largest, measured[r].deviation);
        }
        if (first.empty()) first.assign(meter.motions().begin(), meter.motions().end());
        for (std::size_t r = 0; r < first.size(); ++r) {
            EXPECT_EQ(meter.motions()[r].stretch, first[r].stretch);
            EXPECT_EQ(meter.motions()[r].deviation, first[r].deviation);
        }
    }
    EXPECT_GT(largest, 0.01f);
}

TEST(World, CertifiedAndExactBoundsFindTheSameFacePairs) {
    const Model box({1, 0.4, 0.3}, {6, 3, 2}, 5e4);
    const auto tree = certified_tree(box.body);
    const auto run = [&](BoundKind kind) {
        World world(WorldConfig{});
        world.add_obstacle(test::floor_at(0));
        for (WorldBody body : {box.at({0, 0, 0.16}), box.at({0.05, 0.03, 0.5}, test::turned(0.4))}) {
            body.tree = tree;
            body.bounds = kind;
            world.add_body(std::move(body));
        }
        std::vector<FacePair> pairs;
        for (int i = 0; i < 60; ++i) {
            const WorldReport report = world.step(5e-3);
            EXPECT_EQ(report.failure, "");
            const std::vector<FacePair> now_touching = world.intersecting(0, 1);
            pairs.insert(pairs.end(), now_touching.begin(), now_touching.end());
            const std::span<const RegionMotion> motion = world.motion(1);
            EXPECT_EQ(motion.empty(), kind != BoundKind::certified);
            // The motions belong to the state at the end of the step.
            if (kind == BoundKind::certified && i % 20 == 19) {
                SolidMeter meter(box.body.tets, std::make_shared<const TetRegions>(tree->certified->regions));
                const Vertices x = world.state(1).x.cast<float>();
                const std::span<const RegionMotion> now = meter.measure(x);
                for (std::size_t r = 0; r < now.size(); ++r)
                    EXPECT_NEAR(motion[r].deviation, now[r].deviation, 1e-4);
            }
        }
        return std::pair(pairs, Nodes(world.state(1).x));
    };
    const auto [exact_pairs, exact_x] = run(BoundKind::exact);
    const auto [certified_pairs, certified_x] = run(BoundKind::certified);
    EXPECT_GT(exact_pairs.size(), 10u);
    EXPECT_EQ(exact_pairs, certified_pairs);
    EXPECT_EQ(exact_x, certified_x);
}

TEST(World, MeasuresMotionsAgainAfterARestore) {
    const Model box({1, 0.4, 0.3}, {4, 2, 2});
    World world(WorldConfig{});
    WorldBody body = box.at({0, 0, 1});
    body.tree = certified_tree(box.body);
    body.bounds = BoundKind::certified;
    body.state.v.col(0) = 3 * body.state.x.col(0);  // stretches the body
    world.add_body(std::move(body));
    const WorldSnapshot start = world.snapshot();
    const float before = world.motion(0)[0].stretch;
    for (int i = 0; i < 5; ++i) ASSERT_EQ(world.step(0.01).failure, "");
    EXPECT_GT(world.motion(0)[0].stretch, before + 0.02f);
    world.restore(start);
    EXPECT_EQ(world.motion(0)[0].stretch, before);
}

}  // namespace
}  // namespace nbd
