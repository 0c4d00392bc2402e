#include "collision/query/closest_query.hpp"

#include <gtest/gtest.h>

#include <random>

#include "tests/collision/models.hpp"
#include "tests/support/brute_force.hpp"

namespace nbd {
namespace {

using shapes::Surface;
using test::brute_force_closest;
using test::face_triangle;

/// Tolerance between two ways of computing the points, metres.
constexpr double rounding = 1e-12;

PosedTree posed(const Surface& s, BoundKind kind, int depth = 5) {
    return {shared_exact_tree(s.X, s.F, {.depth = depth}), kind};
}

TEST(ClosestQuery, AgreesWithBruteForceForAllExactBounds) {
    const Surface s = shapes::torus(16, 9), t = shapes::bar(11, 8);
    std::mt19937 random(2);
    ClosestQuery query;
    int apart = 0, touching = 0;
    long tests = 0;
    for (int pose = 0; pose < 16; ++pose) {
        // Poses range from far apart to one body inside the other; some are far from the origin.
        const Eigen::RowVector3f offset(pose % 4 == 3 ? 800.f : 0.f, 0, 0);
        const Eigen::RowVector3f between =
            Eigen::RowVector3f(1, 0.5f, 0.2f) * (0.15f * static_cast<float>(pose));
        const Vertices x = shapes::wobbled(s.X, random, 0.05f).rowwise() + offset;
        const Vertices y =
            shapes::moved(shapes::wobbled(t.X, random, 0.05f), shapes::random_motion(random, 0.1f))
                .rowwise() +
            (offset + between);
        const auto expected = brute_force_closest(x, s.F, y, t.F);
        ++(expected.distance > 0 ? apart : touching);
        for (const auto& [kind_a, kind_b] :
             {std::pair(BoundKind::exact, BoundKind::exact), std::pair(BoundKind::boxes, BoundKind::boxes),
              std::pair(BoundKind::exact, BoundKind::boxes)}) {
            PosedTree a = posed(s, kind_a), b = posed(t, kind_b, 3);
            a.begin_pose(x);
            b.begin_pose(y);
            const auto found = query.closest(a, b);
            ASSERT_TRUE(found) << "pose " << pose;
            EXPECT_NEAR(found->points.distance, expected.distance, rounding) << "pose " << pose;
            if (expected.distance > 0) {
                EXPECT_EQ(found->faces, expected.faces) << "pose " << pose;
                EXPECT_NEAR((found->points.a - found->points.b).norm(), expected.distance, 1e-9);
                EXPECT_TRUE(query.closest(a, b, expected.distance));
                EXPECT_FALSE(query.closest(a, b, std::nextafter(expected.distance, 0.)));
            }
            tests += query.triangle_tests();
        }
    }
    EXPECT_GE(apart, 6);
    EXPECT_GE(touching, 3);
    EXPECT_LT(tests, 16 * 3 * s.F.rows() * t.F.rows() / 50);
}

TEST(ClosestQuery, LearnedBoundsReportTheDistanceOfARealFacePair) {
    const Surface s = shapes::torus(20, 12);
    const auto tree = shapes::shared_full_tree(s, 8, 60, 1);
    std::mt19937 random(4);
    const Vertices x = shapes::wobbled(s.X, random, 0.02f);
    const Vertices y = shapes::wobbled(s.X, random, 0.02f).rowwise() + Eigen::RowVector3f(0.3f, 0.2f, 0.6f);
    const double expected = brute_force_closest(x, s.F, y, s.F).distance;
    ASSERT_GT(expected, 0.01);
    ClosestQuery query;
    for (const BoundKind kind : shapes::kinds_of(*tree)) {
        PosedTree a(tree, kind), b(tree, kind);
        a.begin_pose(x);
        b.begin_pose(y);
        const auto found = query.closest(a, b);
        ASSERT_TRUE(found) << name(kind);
        EXPECT_GE(found->points.distance, expected - rounding) << name(kind);
        EXPECT_NEAR(
            found->points.distance,
            triangle_distance(face_triangle(x, s.F, found->faces.a), face_triangle(y, s.F, found->faces.b)),
            rounding);
        if (is_exact(kind)) {
            EXPECT_NEAR(found->points.distance, expected, rounding) << name(kind);
        }
    }
}

}  // namespace
}  // namespace nbd
