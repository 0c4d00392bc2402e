#include <gtest/gtest.h>

#include <random>

#include "collision/query/many_body_query.hpp"
#include "collision/query/pair_query.hpp"
#include "collision/tree/auto_bounds.hpp"
#include "tests/collision/models.hpp"
#include "tests/collision/wide_tree/hung_surface.hpp"
#include "tests/support/brute_force.hpp"

namespace nbd {
namespace {

/// A torus with calibrated learned bounds.
std::shared_ptr<const CollisionTree> learned_torus(const shapes::Surface& s) {
    return shapes::shared_full_tree(s, 6, 40, 1, {.depth = 4});
}

TEST(AutoQuery, TakesLearnedBoundsFromManyFacesOn) {
    for (const int across : {223, 224}) {  // 99,904 and 100,352 faces
        const shapes::Surface s = shapes::torus(across, 224);
        CollisionTree tree = make_exact_tree(s.X, s.F, {.depth = 8});
        tree.learned_affine = shapes::sampled_affine_model(tree, s.X);
        const auto bare = std::make_shared<const CollisionTree>(tree);
        tree.calibrations[BoundKind::learned_affine] = shapes::no_margins(tree, BoundKind::learned_affine);
        const auto calibrated = std::make_shared<const CollisionTree>(std::move(tree));
        const BoundKind expected = across == 224 ? BoundKind::learned_affine : BoundKind::boxes;
        EXPECT_EQ(bounds_of_auto(*calibrated, false, {}), expected);
        EXPECT_EQ(bounds_of_auto(*bare, false, {}), BoundKind::boxes);
        EXPECT_EQ(bounds_of_auto(*bare, false, 0.1f), expected);
        PosedTree a(calibrated, BoundKind::automatic), b(calibrated, BoundKind::automatic),
            c(calibrated, expected), d(calibrated, expected);
        const Vertices y = s.X.rowwise() + Eigen::RowVector3f(0.1f, 0.05f, 0.02f);
        for (const auto& [body, positions] : {std::pair(&a, &s.X), {&b, &y}, {&c, &s.X}, {&d, &y}})
            body->begin_pose(*positions);
        PairQuery query, other;
        const auto found = test::listed(query.intersecting(a, b));
        EXPECT_GT(found.size(), 100u);
        EXPECT_EQ(found, test::listed(other.intersecting(c, d)));
        EXPECT_EQ(a.chosen(), expected);
        EXPECT_EQ(query.counters().nodes_bounded, other.counters().nodes_bounded);
        a.begin_step(s.X, y);
        EXPECT_EQ(a.chosen(), BoundKind::boxes);
    }
}

TEST(AutoQuery, MixesWithEveryKind) {
    const shapes::Surface s = shapes::torus(40, 24);
    const auto tree = learned_torus(s);
    std::mt19937 random(3);
    const Vertices x = shapes::moved(s.X, shapes::random_motion(random, 0.2f)),
                   y = shapes::moved(s.X, shapes::random_motion(random, 0.2f));
    const auto expected = test::brute_force_intersecting(x, s.F, y, s.F);
    ASSERT_GT(expected.size(), 10u);
    for (const BoundKind kind : shapes::kinds_of(*tree)) {
        PosedTree a(tree, BoundKind::automatic), b(tree, kind, can_miss(kind) ? 10.f : 0.f);
        a.begin_pose(x);
        b.begin_pose(y);
        PairQuery query;
        const auto found = test::listed(query.intersecting(a, b));
        EXPECT_EQ(found, expected) << name(kind) << ", of which spheres meet boxes as exact boxes";
        EXPECT_EQ(a.chosen(), BoundKind::boxes) << name(kind);
        EXPECT_EQ(b.chosen(), kind == BoundKind::automatic ? BoundKind::boxes : kind);
        b.begin_step(x, y);
        EXPECT_EQ(b.chosen(), is_box(kind) ? BoundKind::boxes : kind);
    }
}

TEST(AutoQuery, OfAffineAndExactBoxesIsExact) {
    std::mt19937 random(5);
    const test::HungSurface s = test::hung_on_tets(shapes::torus(24, 12), 3);
    CollisionTree tree = make_exact_tree(s.surface.X, s.surface.F);
    const auto bare = std::make_shared<const CollisionTree>(tree);
    hang_on_nodes(tree, s.W, s.rest);
    const auto hung = std::make_shared<const CollisionTree>(std::move(tree));
    PosedTree a(bare, BoundKind::automatic), b(hung, BoundKind::automatic);
    PairQuery query;
    for (int i = 0; i < 4; ++i) {
        const Vertices x = shapes::moved(s.surface.X, shapes::random_motion(random, 0.2f)),
                       nodes = shapes::moved(s.rest, shapes::random_motion(random, 0.2f));
        Vertices y;
        apply_embedding(s.W, nodes, y);
        const auto expected = test::brute_force_intersecting(x, s.surface.F, y, s.surface.F);
        a.begin_pose(x);
        b.begin_pose_of_nodes(nodes);
        EXPECT_EQ(test::listed(query.intersecting(a, b)), expected);
        EXPECT_EQ(a.chosen(), BoundKind::boxes);
        EXPECT_EQ(b.chosen(), BoundKind::affine);
        b.begin_pose(y);
        EXPECT_EQ(test::listed(query.intersecting(a, b)), expected);
        EXPECT_EQ(b.chosen(), BoundKind::boxes);
        EXPECT_GT(expected.size(), 10u);
    }
}

}  // namespace
}  // namespace nbd
