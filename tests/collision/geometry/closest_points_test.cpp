#include "collision/geometry/closest_points.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "collision/geometry/triangle_triangle.hpp"
#include "tests/support/random_triangles.hpp"

namespace nbd {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

using Corners = std::vector<Vector3d>;

Corners corners(const Triangle& t) { return {t.a.cast<double>(), t.b.cast<double>(), t.c.cast<double>()}; }

double size_of(const Corners& a, const Corners& b) {
    double size = 0;
    for (const Corners& x : {a, b})
        for (const Vector3d& p : x) size = std::max(size, (p - a[0]).norm());
    return size;
}

/// Proves that c is optimal. Its points belong to a and b, so the true distance is at most c.distance. A slab
/// as wide as the gap has a on one side and b on the other, so it is at least c.distance.
void expect_closest(const ClosestPoints& c, const Corners& a, const Corners& b, double tolerance = 1e-12) {
    const double size = size_of(a, b), offset = a[0].norm();
    const double error = tolerance * size, point_error = error + 1e-15 * offset;
    const auto point = [](const Corners& x, const Vector3d& w) {
        Vector3d sum = Vector3d::Zero();
        for (std::size_t i = 0; i < x.size(); ++i) sum += w[i] * x[i];
        return sum;
    };
    for (const Vector3d& w : {c.weights_a, c.weights_b}) {
        ASSERT_GE(w.minCoeff(), 0);
        ASSERT_NEAR(w.sum(), 1, 1e-14);
    }
    ASSERT_LE((point(a, c.weights_a) - c.a).norm(), point_error);
    ASSERT_LE((point(b, c.weights_b) - c.b).norm(), point_error);
    ASSERT_LE((c.a - c.b - c.gap).norm(), point_error + (c.distance == 0 ? 1e-10 * size : 0));
    ASSERT_NEAR(c.gap.norm(), c.distance, 1e-15 * c.distance);
    if (c.distance <= error) return;
    const Vector3d normal = c.gap / c.distance;
    double least_a = HUGE_VAL, most_b = -HUGE_VAL;
    for (const Vector3d& x : a) least_a = std::min(least_a, normal.dot(x - a[0]));
    for (const Vector3d& x : b) most_b = std::max(most_b, normal.dot(x - a[0]));
    // An error `error` of the gap tilts the slab by error / distance.
    ASSERT_GE(least_a - most_b, c.distance - error - size * error / c.distance);
}

TEST(ClosestPoints, MatchKnownAnswersForAPointAndATriangle) {
    const Vector3d u(0, 0, 0), v(4, 0, 0), w(0, 4, 0);
    const auto expect_nearest = [&](Vector3d p, Vector3d nearest, Vector3d weights) {
        const ClosestPoints c = closest_point_triangle(p, u, v, w);
        expect_closest(c, {p}, {u, v, w});
        EXPECT_NEAR((c.b - nearest).norm(), 0, 1e-15);
        EXPECT_NEAR((c.weights_b - weights).norm(), 0, 1e-15);
        EXPECT_EQ(c.a, p);
        EXPECT_NEAR(c.distance, (p - nearest).norm(), 1e-15);
    };
    expect_nearest({1, 1, 5}, {1, 1, 0}, {.5, .25, .25});  // face
    expect_nearest({1, 1, 0}, {1, 1, 0}, {.5, .25, .25});  // in the face
    expect_nearest({1, -2, 3}, {1, 0, 0}, {.75, .25, 0});  // edges
    expect_nearest({-2, 3, -1}, {0, 3, 0}, {.25, 0, .75});
    expect_nearest({4, 4, 1}, {2, 2, 0}, {0, .5, .5});
    expect_nearest({-1, -2, 1}, {0, 0, 0}, {1, 0, 0});  // vertices
    expect_nearest({7, 1, 0}, {4, 0, 0}, {0, 1, 0});
    expect_nearest({0, 9, 0}, {0, 4, 0}, {0, 0, 1});
}

TEST(ClosestPoints, MatchKnownAnswersForTwoEdges) {
    const auto distance = [](Vector3d p, Vector3d q, Vector3d u, Vector3d v) {
        const ClosestPoints c = closest_edge_edge(p, q, u, v);
        expect_closest(c, {p, q}, {u, v});
        return c.distance;
    };
    EXPECT_DOUBLE_EQ(distance({-1, 0, 0}, {1, 0, 0}, {0, -1, 2}, {0, 1, 2}), 2);  // crossing
    EXPECT_DOUBLE_EQ(distance({-1, 0, 0}, {1, 0, 0}, {0, 3, 4}, {0, 9, 4}), 5);   // endpoint over the middle
    EXPECT_DOUBLE_EQ(distance({-1, 0, 0}, {1, 0, 0}, {4, 4, 0}, {5, 9, 0}), 5);   // endpoint to endpoint
    EXPECT_DOUBLE_EQ(distance({0, 0, 0}, {4, 0, 0}, {1, 3, 0}, {9, 3, 0}), 3);    // parallel, side by side
    EXPECT_DOUBLE_EQ(distance({0, 0, 0}, {4, 0, 0}, {7, 4, 0}, {9, 4, 0}), 5);    // parallel, apart
    EXPECT_DOUBLE_EQ(distance({0, 0, 0}, {4, 0, 0}, {6, 0, 0}, {9, 0, 0}), 2);    // collinear
    EXPECT_DOUBLE_EQ(distance({0, 0, 0}, {4, 0, 0}, {3, 0, 0}, {9, 0, 0}), 0);    // collinear, overlapping
    EXPECT_DOUBLE_EQ(distance({0, 0, 0}, {0, 0, 0}, {-1, 2, 0}, {1, 2, 0}), 2);   // a point
    EXPECT_DOUBLE_EQ(distance({-1, 2, 0}, {1, 2, 0}, {0, 0, 0}, {0, 0, 0}), 2);
    EXPECT_DOUBLE_EQ(distance({1, 2, 3}, {1, 2, 3}, {1, 2, 5}, {1, 2, 5}), 2);
}

TEST(ClosestPoints, AreAccurateForNearlyParallelEdges) {
    for (double slope = 1e-1; slope > 1e-18; slope /= 10)
        for (const double height : {1e-12, 1e-6, 1., 1e3}) {
            const Vector3d p(-1, 0, 0), q(1, 0, 0), u(-1, -slope, height), v(1, slope, height);
            const ClosestPoints c = closest_edge_edge(p, q, u, v);
            expect_closest(c, {p, q}, {u, v}, 1e-13);
            EXPECT_NEAR(c.distance / height, 1, 1e-12) << "slope " << slope << ", height " << height;
        }
}

TEST(ClosestPoints, AreOptimalForRandomPointsAndEdges) {
    RandomTriangles random(6);
    int touching = 0;
    for (int round = 0; round < 40000 && !testing::Test::HasFatalFailure(); ++round) {
        // Half of the rounds use a grid, where features are often parallel, degenerate or touching.
        const auto make = [&] { return corners(round % 2 ? random.grid_triangle(2) : random.triangle()); };
        const Corners s = make(), t = make();
        const ClosestPoints point = closest_point_triangle(s[0], t[0], t[1], t[2]);
        expect_closest(point, {s[0]}, t);
        EXPECT_EQ(point.weights_a, Vector3d::UnitX());
        const ClosestPoints edge = closest_edge_edge(s[0], s[1], t[0], t[1]);
        expect_closest(edge, {s[0], s[1]}, {t[0], t[1]});
        EXPECT_EQ(edge.weights_a[2], 0);
        EXPECT_EQ(edge.weights_b[2], 0);
        touching += edge.distance < 1e-14;
    }
    EXPECT_GT(touching, 1000);
}

TEST(ClosestPoints, MatchKnownAnswersForEveryFeaturePairOfTwoTriangles) {
    const Triangle flat{{0, 0, 0}, {4, 0, 0}, {0, 4, 0}};
    const auto distance = [&](const Triangle& t) {
        expect_closest(closest_triangle_triangle(flat, t), corners(flat), corners(t));
        EXPECT_EQ(triangle_distance(t, flat), triangle_distance(flat, t));
        return triangle_distance(flat, t);
    };
    EXPECT_DOUBLE_EQ(distance({{1, 1, 2}, {1, 2, 3}, {2, 1, 5}}), 2);        // vertex over face
    EXPECT_DOUBLE_EQ(distance({{-9, -9, -3}, {9, -9, -3}, {0, 9, -3}}), 3);  // flat's vertices over its face
    EXPECT_DOUBLE_EQ(distance({{1, -3, 4}, {2, -6, 8}, {3, -6, 8}}), 5);     // vertex, edge
    EXPECT_DOUBLE_EQ(distance({{-3, 0, 4}, {-3, -9, 9}, {-9, 0, 9}}), 5);    // vertex, vertex
    EXPECT_DOUBLE_EQ(distance({{2, -3, 9}, {2, -3, -9}, {2, -9, 0}}), 3);    // edge, edge
    EXPECT_DOUBLE_EQ(distance({{1, -2, 0}, {3, -2, 0}, {2, -7, 0}}), 2);     // coplanar
    EXPECT_DOUBLE_EQ(distance({{1, 1, 7}, {1, 1, 7}, {1, 1, 7}}), 7);        // a point
    EXPECT_DOUBLE_EQ(distance({{1, 1, 7}, {2, 1, 7}, {3, 1, 7}}), 7);        // a segment
}

TEST(ClosestPoints, AreTheMidpointOfTheIntersectionOfCrossingTriangles) {
    const Triangle flat{{0, 0, 0}, {4, 0, 0}, {0, 4, 0}};
    const Triangle upright{{1, 1, -1}, {3, 1, 1}, {1, 1, 3}};  // the intersection is (1, 1, 0) to (2, 1, 0)
    const ClosestPoints c = closest_triangle_triangle(flat, upright);
    expect_closest(c, corners(flat), corners(upright));
    EXPECT_EQ(c.distance, 0);
    EXPECT_EQ(c.gap, Vector3d::Zero());
    EXPECT_NEAR((c.a - Vector3d(1.5, 1, 0)).norm(), 0, 1e-15);
    EXPECT_NEAR((c.b - Vector3d(1.5, 1, 0)).norm(), 0, 1e-15);
}

class ClosestPointsOfPairs : public testing::Test {
 protected:
    /// Expects optimal closest points, the same distance in both orders, and 0 for pairs that intersect.
    /// Returns the number of intersecting pairs out of `pairs`.
    template <typename Make>
    int count_intersecting(int pairs, Make&& make) {
        int intersecting = 0;
        for (int i = 0; i < pairs && !HasFatalFailure(); ++i) {
            const auto [s, t] = make();
            const ClosestPoints c = closest_triangle_triangle(s, t);
            const double size = size_of(corners(s), corners(t));
            expect_closest(c, corners(s), corners(t));
            EXPECT_NEAR(c.distance, triangle_distance(s, t), 1e-14 * size);
            EXPECT_NEAR(c.distance, triangle_distance(t, s), 1e-12 * size);
            if (!triangles_intersect(s, t)) continue;
            EXPECT_EQ(c.distance, 0);
            ++intersecting;
        }
        return intersecting;
    }
    RandomTriangles random_{2};
};

TEST_F(ClosestPointsOfPairs, AreOptimalForRandomTriangles) {
    const int n = 30000;
    const int hits = count_intersecting(n, [&] { return std::pair{random_.triangle(), random_.triangle()}; });
    EXPECT_GT(hits, n / 10);
    EXPECT_LT(hits, n / 2);
}

TEST_F(ClosestPointsOfPairs, AreOptimalForNearlyTouchingTriangles) {
    const int n = 20000;
    const int hits = count_intersecting(n, [&] {
        const Triangle s = random_.triangle();
        return std::pair(s, random_.nearly_touching(s));
    });
    EXPECT_GT(hits, n / 4);
    EXPECT_LT(hits, n * 3 / 4);
}

TEST_F(ClosestPointsOfPairs, AreOptimalForSlivers) {
    const int n = 20000;
    count_intersecting(n, [&] {
        const auto sliver = [&] {
            const Vector3f a = random_.point(), b = random_.point();
            return Triangle{a, b, random_.nudged(a + random_.uniform() * (b - a))};
        };
        const Triangle s = sliver();
        return std::pair(s, random_.integer(0, 1) ? sliver() : random_.triangle());
    });
}

TEST_F(ClosestPointsOfPairs, AreOptimalAtAnyScaleAndOffset) {
    for (const float scale : {0x1p-140f, 0x1p-60f, 0x1p60f, 0x1p126f})
        count_intersecting(2000, [&] {
            const auto scaled = [&] {
                const Triangle t = random_.triangle();
                return Triangle{t.a * scale, t.b * scale, t.c * scale};
            };
            const Triangle s = scaled();
            return std::pair(s, scaled());
        });
    count_intersecting(2000, [&] {
        const Vector3f o(1e6f, -3e5f, 2e6f);
        const auto moved = [&] {
            const Triangle t = random_.grid_triangle(5);
            return Triangle{t.a + o, t.b + o, t.c + o};
        };
        const Triangle s = moved();
        return std::pair(s, moved());
    });
}

}  // namespace
}  // namespace nbd
