#include "apps/bench/exactness/exactness.hpp"

#include <gtest/gtest.h>

#include <string>

#include "tests/support/brute_force.hpp"
#include "tests/training/bar.hpp"

namespace nbd {
namespace {

BenchBody small_bar() {
    test::Bar bar(0, 4);
    bar.body.solid.X = bar.rest.cast<double>();
    return make_bench_body(std::move(bar.body));
}

TEST(SweptPairs, EqualBruteForce) {
    const BenchBody body = small_bar();
    const Faces& F = body.surface.F;
    std::size_t intersecting = 0, within = 0;
    for (const WildPose pose : wild_poses)
        for (std::uint64_t stream = 0; stream < 2; ++stream) {
            const WildScene scene =
                draw_wild_scene(body.surface.solid.X.cast<float>(), pose, 0.4, CounterRandom(1, stream));
            const Vertices a = embedded(body.surface.W, scene.a), b = embedded(body.surface.W, scene.b);
            const auto touching = swept_pairs(a, F, b, F, 0), near = swept_pairs(a, F, b, F, 0.05f);
            EXPECT_EQ(touching, test::brute_force_intersecting(a, F, b, F)) << name(pose);
            EXPECT_EQ(near, test::brute_force_within(a, F, b, F, 0.05f)) << name(pose);
            intersecting += touching.size();
            within += near.size();
        }
    EXPECT_GT(intersecting, 50u);
    EXPECT_GT(within, 2 * intersecting);
}

TEST(Exactness, TellsTheFirstDifference) {
    BenchBody body = small_bar();
    CollisionTree tree = *body.tree;
    const Vertices elsewhere = body.surface.solid.X.cast<float>() * 0.5f;
    SurfaceEmbedding first_node(body.surface.W.rows(), body.surface.W.cols());
    for (int v = 0; v < first_node.rows(); ++v) first_node.insert(v, 0) = 1;
    hang_on_nodes(tree, first_node, elsewhere);  // not how the surface hangs on its nodes
    body.tree = std::make_shared<const CollisionTree>(std::move(tree));
    long different = 0;
    for (const auto& row : check_exactness("bar", body, {.scenes = 5}, [](int) {})) {
        const auto first = row["first_difference"].get<std::string>();
        different += row["different"].get<long>();
        EXPECT_EQ(first.empty(), row["different"] == 0);
        if (!first.empty()) {
            EXPECT_NE(first.find("affine against affine"), std::string::npos) << first;
        }
    }
    EXPECT_GT(different, 0);
}

}  // namespace
}  // namespace nbd
