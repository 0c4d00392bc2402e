#include "collision/posed_tree.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/collision/models.hpp"
#include "tests/support/error_of.hpp"

namespace nbd {
namespace {

struct PosedTreeTest : testing::Test {
    shapes::Surface s = shapes::torus(16, 10);
    std::shared_ptr<const CollisionTree> full = std::make_shared<const CollisionTree>(
        shapes::full_tree(s, shapes::make_modes(s, 6, 40, 1), {.depth = 3}));
    std::shared_ptr<const CollisionTree> bare =
        std::make_shared<const CollisionTree>(make_exact_tree(s.X, s.F, {.depth = 3}));
};

TEST_F(PosedTreeTest, CountsEachNodeOnceAPose) {
    for (const BoundKind kind : {BoundKind::exact, BoundKind::bd, BoundKind::modal}) {
        PosedTree posed(full, kind);
        EXPECT_EQ(posed.kind(), kind);
        EXPECT_EQ(&posed.tree(), full.get());
        posed.begin_pose(s.X);
        EXPECT_EQ(posed.nodes_bounded(), 0);
        for (const int node : {0, 3, 0, 3, 14}) posed.sphere(node);
        EXPECT_EQ(posed.nodes_bounded(), 3);
        const Vertices x = s.X * 1.5f;
        const Sphere before = posed.sphere(3);
        posed.begin_pose(x);
        EXPECT_EQ(posed.nodes_bounded(), 0);
        EXPECT_NE(posed.sphere(3).c, before.c);
        EXPECT_EQ(posed.nodes_bounded(), 1);
    }
}

TEST_F(PosedTreeTest, AMarginGrowsTheRadiusAlone) {
    for (const BoundKind kind : {BoundKind::exact, BoundKind::bd, BoundKind::modal}) {
        PosedTree plain(full, kind), wide(full, kind, 0.25f);
        plain.begin_pose(s.X);
        wide.begin_pose(s.X);
        for (int node = 0; node < 15; ++node) {
            EXPECT_EQ(wide.sphere(node).c, plain.sphere(node).c);
            EXPECT_FLOAT_EQ(wide.sphere(node).r, plain.sphere(node).r * 1.25f);
        }
    }
}

TEST_F(PosedTreeTest, CanBeMoved) {
    PosedTree first(bare, BoundKind::exact);
    first.begin_pose(s.X);
    const Sphere root = first.sphere(0);
    PosedTree second = std::move(first);
    EXPECT_EQ(second.sphere(0).c, root.c);
    EXPECT_EQ(second.nodes_bounded(), 1);
}

TEST_F(PosedTreeTest, RefusesWhatItCannotBound) {
    EXPECT_EQ(test::refusal([&] { PosedTree(nullptr, BoundKind::exact); }),
              "a posed tree needs a collision tree, got none");
    EXPECT_EQ(test::refusal([&] { PosedTree(bare, BoundKind::bd); }),
              "the collision tree has no model for \"bd\" bounds, only for exact");
    EXPECT_EQ(test::refusal([&] { PosedTree(bare, BoundKind::modal); }),
              "the collision tree has no model for \"modal\" bounds, only for exact");
    auto without_bd = std::make_shared<CollisionTree>(*full);
    without_bd->bd.reset();
    EXPECT_EQ(test::refusal([&] { PosedTree(without_bd, BoundKind::bd); }),
              "the collision tree has no model for \"bd\" bounds, only for exact, modal");
    EXPECT_EQ(test::refusal([&] { PosedTree(bare, BoundKind::exact, -0.1f); }),
              "margin is -0.1, allowed: finite and 0 or more");
    EXPECT_EQ(test::refusal([&] { PosedTree(bare, BoundKind::exact, INFINITY); }),
              "margin is inf, allowed: finite and 0 or more");
    EXPECT_EQ(test::refusal([&] { PosedTree(bare, BoundKind::exact, NAN); }),
              "margin is nan, allowed: finite and 0 or more");
    auto broken = std::make_shared<CollisionTree>(*full);
    broken->faces(3, 1) = 160;
    EXPECT_EQ(test::refusal([&] { PosedTree(broken, BoundKind::exact); }),
              "sphere tree: face 3 refers to vertex 160, but the surface has 160 vertices");
}

TEST(BoundKinds, HaveNames) {
    for (const BoundKind kind : {BoundKind::exact, BoundKind::bd, BoundKind::modal})
        EXPECT_EQ(bound_kind(name(kind)), kind);
    EXPECT_EQ(test::refusal([] { bound_kind("local"); }),
              "unknown bounds \"local\", known: exact, bd, modal");
}

}  // namespace
}  // namespace nbd
