// All exact bounds, mixed pairs of them included, with all kernels of this machine.
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <random>
#include <utility>

#include "collision/kernels/kernels.hpp"
#include "collision/query/closest_query.hpp"
#include "collision/query/pair_query.hpp"
#include "tests/collision/wide_tree/hung_surface.hpp"
#include "tests/support/brute_force.hpp"

namespace nbd {
namespace {

constexpr std::pair<BoundKind, BoundKind> mixes[] = {
    {BoundKind::affine, BoundKind::affine}, {BoundKind::boxes, BoundKind::boxes},
    {BoundKind::exact, BoundKind::exact},   {BoundKind::automatic, BoundKind::automatic},
    {BoundKind::affine, BoundKind::boxes},  {BoundKind::exact, BoundKind::affine},
    {BoundKind::affine, BoundKind::exact},
};

void begin(PosedTree& tree, const Vertices& x, const Vertices& nodes) {
    if (tree.takes_nodes())
        tree.begin_pose_of_nodes(nodes);
    else
        tree.begin_pose(x);
}

TEST(ExactBounds, GiveTheAnswersOfBruteForceInWildPosesWithEveryKernel) {
    std::mt19937 random(1);
    PairQuery query;
    ClosestQuery closest;
    const Kernels& before = kernels();
    std::size_t intersecting = 0, near = 0;
    for (const test::HungSurface& hung :
         {test::hung_on_tets(shapes::torus(24, 12), 3), test::hung_on_lattice(shapes::bar(20, 14), 4)}) {
        CollisionTree made = make_exact_tree(hung.surface.X, hung.surface.F, {.depth = 4});
        hang_on_nodes(made, hung.W, hung.rest);
        const auto tree = std::make_shared<const CollisionTree>(std::move(made));
        const Faces& F = hung.surface.F;
        for (int kind = 0; kind < 2 * test::wild_poses; ++kind) {
            const Vertices nodes_a = test::wild_pose(hung.rest, kind % test::wild_poses, random);
            Vertices nodes_b = test::wild_pose(hung.rest, kind % test::wild_poses, random);
            const float size = (nodes_a.colwise().maxCoeff() - nodes_a.colwise().minCoeff()).norm();
            nodes_b.rowwise() += nodes_a.colwise().mean() - nodes_b.colwise().mean();
            nodes_b.rowwise() += 0.3f * size * shapes::uniform3(random).transpose();
            const Vertices a = embedded(hung.W, nodes_a), b = embedded(hung.W, nodes_b);
            const float distance = 0.01f * size;
            const auto meet = test::brute_force_intersecting(a, F, b, F),
                       within = test::brute_force_within(a, F, b, F, distance);
            const double gap = test::brute_force_closest(a, F, b, F).distance;
            intersecting += meet.size();
            near += within.size();
            for (const auto set : instruction_sets) {
                const Kernels* form = kernels_for(set);
                if (!form) continue;
                use_kernels(*form);
                for (const auto& [kind_a, kind_b] : mixes) {
                    SCOPED_TRACE(testing::Message() << name(kind_a) << " against " << name(kind_b) << ", "
                                                    << name(set) << " kernels, pose " << kind);
                    PosedTree tree_a(tree, kind_a), tree_b(tree, kind_b);
                    begin(tree_a, a, nodes_a);
                    begin(tree_b, b, nodes_b);
                    EXPECT_TRUE(std::ranges::equal(query.intersecting(tree_a, tree_b), meet));
                    EXPECT_TRUE(std::ranges::equal(query.within(tree_a, tree_b, distance), within));
                    EXPECT_NEAR(closest.closest(tree_a, tree_b)->points.distance, gap,
                                1e-12 * (1 + a.norm()));
                }
            }
            use_kernels(before);
        }
    }
    EXPECT_GT(intersecting, 1000U);
    EXPECT_GT(near, 2 * intersecting);
}

}  // namespace
}  // namespace nbd
