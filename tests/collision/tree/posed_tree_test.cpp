#include "collision/tree/posed_tree.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "collision/query/pair_query.hpp"
#include "tests/collision/models.hpp"
#include "tests/support/error_of.hpp"

namespace nbd {
namespace {

struct PosedTreeTest : testing::Test {
    shapes::Surface s = shapes::torus(16, 10);
    std::shared_ptr<const CollisionTree> full = shapes::shared_full_tree(s, 6, 40, 1, {.depth = 3});
    std::shared_ptr<const CollisionTree> bare = shared_exact_tree(s.X, s.F, {.depth = 3});
};

TEST_F(PosedTreeTest, CountsEachNodeOncePerPose) {
    for (const BoundKind kind : shapes::kinds_of(*full)) {
        PosedTree posed(full, kind);
        EXPECT_EQ(posed.kind(), kind);
        if (is_box(kind)) {
            EXPECT_EQ(test::refusal([&] { posed.sphere(0); }),
                      "spheres of nodes of a body with " + std::string(name(kind)) +
                          " bounds, which are boxes of a wide tree; allowed: exact, bd, nbd");
            continue;
        }
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

TEST_F(PosedTreeTest, SpheresInAStepHoldThoseOfBothEnds) {
    const Vertices end = (s.X * 1.2f).rowwise() + Eigen::RowVector3f(0.7f, 0.2f, 0);
    for (const BoundKind kind : {BoundKind::exact, BoundKind::bd, BoundKind::nbd}) {
        const std::optional<float> margin = can_miss(kind) ? std::optional(0.25f) : std::nullopt;
        PosedTree in_step(full, kind, margin), at_start(full, kind, margin), at_end(full, kind, margin);
        in_step.begin_pose(s.X);
        in_step.sphere(3);
        at_start.begin_pose(s.X);
        at_end.begin_pose(end);
        for (int step = 0; step < 2; ++step) {
            in_step.begin_step(s.X, end);
            EXPECT_EQ(in_step.nodes_bounded(), 0) << name(kind);
            EXPECT_EQ(in_step.chosen(), kind);
            for (int node = 0; node < 15; ++node) {
                const Sphere both = joined(at_start.sphere(node), at_end.sphere(node));
                EXPECT_EQ(in_step.sphere(node).c, both.c) << name(kind) << ", node " << node;
                EXPECT_EQ(in_step.sphere(node).r, both.r) << name(kind) << ", node " << node;
            }
            in_step.sphere(3);
            EXPECT_EQ(in_step.nodes_bounded(), 30) << name(kind) << ": each node at both ends";
            in_step.wide_tree();  // changes nothing
            EXPECT_EQ(in_step.chosen(), kind);
            EXPECT_NE(in_step.nbd_tree(), nullptr);
        }
        in_step.begin_pose(s.X);
        EXPECT_EQ(in_step.nodes_bounded(), 0) << name(kind);
        EXPECT_EQ(in_step.sphere(3).c, at_start.sphere(3).c) << name(kind);
        EXPECT_EQ(in_step.sphere(3).r, at_start.sphere(3).r) << name(kind);
        EXPECT_EQ(in_step.nodes_bounded(), 1) << name(kind);
    }
}

TEST_F(PosedTreeTest, AMarginGrowsOnlyTheRadius) {
    for (const BoundKind kind : shapes::kinds_of(*full)) {
        if (is_box(kind)) continue;
        PosedTree plain(full, kind), wide(full, kind, 0.25f);
        plain.begin_pose(s.X);
        wide.begin_pose(s.X);
        for (int node = 0; node < 15; ++node) {
            EXPECT_EQ(wide.sphere(node).c, plain.sphere(node).c);
            EXPECT_FLOAT_EQ(wide.sphere(node).r, plain.sphere(node).r * 1.25f);
        }
    }
}

TEST_F(PosedTreeTest, UsesTheCalibratedMarginsUnlessAMarginIsGiven) {
    auto calibrated = std::make_shared<CollisionTree>(*full);
    Calibration& calibration = calibrated->calibrations[BoundKind::bd];
    calibration = {.miss_rate = 0.01, .confidence = 0.9, .trajectories = 20, .poses = 400};
    for (int node = 0; node < 15; ++node) calibration.margins.push_back(0.01f * static_cast<float>(node));
    PosedTree plain(full, BoundKind::bd), by_default(calibrated, BoundKind::bd),
        without(calibrated, BoundKind::bd, 0.f), other(calibrated, BoundKind::nbd),
        paper(full, BoundKind::nbd);
    for (PosedTree* posed : {&plain, &by_default, &without, &other, &paper}) posed->begin_pose(s.X);
    for (int node = 0; node < 15; ++node) {
        EXPECT_EQ(by_default.sphere(node).c, plain.sphere(node).c);
        EXPECT_FLOAT_EQ(by_default.sphere(node).r,
                        plain.sphere(node).r * (1 + 0.01f * static_cast<float>(node)));
        EXPECT_EQ(without.sphere(node).r, plain.sphere(node).r);
        EXPECT_EQ(other.sphere(node).r, paper.sphere(node).r);
    }
}

TEST_F(PosedTreeTest, RefusesBoundsThatMissWithoutCalibrationAndMargin) {
    auto uncalibrated = std::make_shared<CollisionTree>(*full);
    uncalibrated->calibrations.clear();
    int refused = 0;
    for (const BoundKind kind : shapes::kinds_of(*full)) {
        EXPECT_EQ(test::refusal([&] { PosedTree(uncalibrated, kind); }),
                  can_miss(kind) ? "the tree's \"" + std::string(name(kind)) +
                                       "\" bounds are not calibrated, so that nodes miss at no stated rate; "
                                       "run `nbdtree calibrate` on the tree, or give a margin (--margin)"
                                 : "");
        refused += can_miss(kind);
        EXPECT_NO_THROW(PosedTree(full, kind));
        if (can_miss(kind)) {
            EXPECT_NO_THROW(PosedTree(uncalibrated, kind, 0.f));
        }
    }
    EXPECT_EQ(refused, 3);
    // `auto` takes exact boxes instead.
    PosedTree automatic(uncalibrated, BoundKind::automatic), boxes(uncalibrated, BoundKind::boxes);
    automatic.begin_pose(s.X);
    boxes.begin_pose(s.X);
    PairQuery query;
    EXPECT_FALSE(query.intersecting(automatic, boxes).empty());
    EXPECT_EQ(automatic.chosen(), BoundKind::boxes);
}

TEST_F(PosedTreeTest, CanBeMoved) {
    PosedTree first(bare, BoundKind::exact);
    first.begin_pose(s.X);
    const Sphere root = first.sphere(0);
    PosedTree second = std::move(first);
    EXPECT_EQ(second.sphere(0).c, root.c);
    EXPECT_EQ(second.nodes_bounded(), 1);
}

TEST_F(PosedTreeTest, RejectsTreesWithoutTheModelAndInvalidMargins) {
    EXPECT_EQ(test::refusal([&] { PosedTree(nullptr, BoundKind::exact); }),
              "a posed tree needs a collision tree, got none");
    EXPECT_EQ(test::refusal([&] { PosedTree(bare, BoundKind::bd); }),
              "the collision tree has no model for \"bd\" bounds, only for exact, boxes, auto");
    EXPECT_EQ(test::refusal([&] { PosedTree(bare, BoundKind::nbd); }),
              "the collision tree has no model for \"nbd\" bounds, only for exact, boxes, auto");
    auto without_bd = std::make_shared<CollisionTree>(*full);
    without_bd->bd.reset();
    without_bd->calibrations.erase(BoundKind::bd);
    EXPECT_EQ(
        test::refusal([&] { PosedTree(without_bd, BoundKind::bd); }),
        "the collision tree has no model for \"bd\" bounds, only for exact, boxes, nbd, learned_affine, "
        "auto");
    EXPECT_EQ(test::refusal([&] { PosedTree(bare, BoundKind::exact, -0.1f); }),
              "margin is -0.1, allowed: finite and 0 or more");
    EXPECT_EQ(test::refusal([&] { PosedTree(bare, BoundKind::boxes, 0.1f); }),
              "margin is 0.1, but exact boxes take none");
    EXPECT_EQ(test::refusal([&] { PosedTree(bare, BoundKind::exact, INFINITY); }),
              "margin is inf, allowed: finite and 0 or more");
    EXPECT_EQ(test::refusal([&] { PosedTree(bare, BoundKind::exact, NAN); }),
              "margin is nan, allowed: finite and 0 or more");
    auto broken = std::make_shared<CollisionTree>(*full);
    broken->faces(3, 1) = 160;
    EXPECT_EQ(test::refusal([&] { PosedTree(broken, BoundKind::exact); }),
              "sphere tree: face 3 refers to vertex 160, but the surface has 160 vertices");
}

TEST_F(PosedTreeTest, RejectsInvalidCalibrations) {
    const auto refused = [&](BoundKind kind, const Calibration& calibration) {
        auto tree = std::make_shared<CollisionTree>(*full);
        tree->calibrations[kind] = calibration;
        if (kind == BoundKind::bd) tree->bd.reset();
        return test::refusal([&] { PosedTree(tree, BoundKind::exact); });
    };
    const std::vector<float> fifteen(15, 0.1f);
    const Calibration good{
        .miss_rate = 0.01, .confidence = 0.9, .trajectories = 20, .poses = 400, .margins = fifteen};
    const auto with = [&](auto change) {
        Calibration bad = good;
        change(bad);
        return refused(BoundKind::nbd, bad);
    };
    EXPECT_EQ(refused(BoundKind::bd, good), "calibration of bd bounds, but the tree has no model for them");
    EXPECT_EQ(with([](Calibration& c) { c.miss_rate = 0; }),
              "calibration of nbd bounds: miss rate is 0, allowed: above 0 and below 1");
    EXPECT_EQ(with([](Calibration& c) { c.confidence = NAN; }),
              "calibration of nbd bounds: confidence is nan, allowed: above 0 and below 1");
    EXPECT_EQ(with([](Calibration& c) { c.poses = 19; }),
              "calibration of nbd bounds: made from 19 poses of 20 trajectories, allowed: at least 1 "
              "trajectory, with at least 1 pose each");
    EXPECT_EQ(with([](Calibration& c) { c.margins.pop_back(); }),
              "calibration of nbd bounds: has 14 margins for 15 nodes");
    EXPECT_EQ(with([](Calibration& c) { c.margins[3] = -0.1f; }),
              "calibration of nbd bounds: margin of node 3 is -0.1, allowed: finite and 0 or more");
    EXPECT_EQ(with([](Calibration& c) { c.limits = {1}; }),
              "calibration of nbd bounds: has 1 score limits for 15 nodes");
    EXPECT_EQ(with([&](Calibration& c) { (c.limits = fifteen)[7] = INFINITY; }),
              "calibration of nbd bounds: score limit of node 7 is inf, allowed: finite and 0 or more");
}

/// Spheres of half the exact radius; the out-of-distribution score grows with the node's index and is NaN for
/// node 5.
struct HalfSpheres {
    const SphereTree* tree;
    Vertices x;
    void begin_pose(VerticesRef pose) { x = pose; }
    Sphere bound(int node) const {
        Sphere half = bounding_sphere(x, tree->node_vertices(node));
        half.r *= 0.5f;
        return half;
    }
    float ood_score(int node) const { return node == 5 ? NAN : 0.1f * static_cast<float>(node); }
};

TEST(SphereCache, GrowsMarginsWithTheScoreAndUsesExactSpheresOutOfDistribution) {
    const auto s = shapes::torus(16, 10);
    const SphereTree tree = build_sphere_tree(s.X, s.F, {.depth = 3});
    // Rows with a stride, as a caller's vertices may have.
    Eigen::Matrix<float, Eigen::Dynamic, 5, Eigen::RowMajor> wide(s.X.rows(), 5);
    wide.leftCols<3>() = s.X;
    const Eigen::Map<const Vertices, 0, Eigen::OuterStride<>> x(wide.data(), s.X.rows(), 3,
                                                                Eigen::OuterStride<>(5));
    HalfSpheres half{&tree, {}};
    const std::vector<float> margins(15, 2.f);
    SphereCache gated(tree, {margins, std::vector<float>(15, 0.85f)}), open(tree, {margins, {}});
    half.begin_pose(x);
    gated.begin_pose(x);
    open.begin_pose(x);
    for (int node = 0; node < 15; ++node) {
        const Sphere exact = bounding_sphere(s.X, tree.node_vertices(node));
        const bool is_out_of_range = node == 5 || node > 8;
        const float grown =
            0.5f * exact.r * (1 + 2 * (0.03f + 0.97f * 0.1f * static_cast<float>(node) / 0.85f));
        EXPECT_FLOAT_EQ(gated.get(node, half).r, is_out_of_range ? exact.r : grown) << node;
        EXPECT_EQ(open.get(node, half).r, exact.r * 0.5f * 3);
    }
    EXPECT_EQ(gated.out_of_range(), 7);
    EXPECT_EQ(gated.bounded(), 15);
    EXPECT_EQ(open.out_of_range(), 0);
    gated.begin_pose(x);
    EXPECT_EQ(gated.out_of_range(), 0);
}

TEST(BoundKinds, NamesRoundTrip) {
    for (const BoundKind kind : bound_kinds) EXPECT_EQ(bound_kind(name(kind)), kind);
    EXPECT_EQ(test::refusal([] { bound_kind("loca"); }),
              "unknown bounds \"loca\", known: exact, boxes, bd, nbd, learned_affine, affine, auto");
}

}  // namespace
}  // namespace nbd
