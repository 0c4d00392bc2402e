#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

#include "collision/base/counter_random.hpp"
#include "collision/continuous/feature_pair.hpp"

namespace nbd {
namespace {

using Eigen::Vector3d;
using Motion = std::array<MovingPoint, 4>;

MovingPoint still(double x, double y, double z) { return {{x, y, z}, {x, y, z}}; }

MovingPoint moved(const MovingPoint& p, const Vector3d& by) { return {p.begin, p.end + by}; }

double distance_at(FeatureKind kind, const Motion& x, double time) {
    std::array<Vector3d, 4> y;
    for (std::size_t k = 0; k < 4; ++k) y[k] = (1 - time) * x[k].begin + time * x[k].end;
    return closest_points(kind, y).distance;
}

const Motion above_face{still(0.2, 0.2, 1), still(0, 0, 0), still(1, 0, 0), still(0, 1, 0)};
const Motion crossed_edges{still(-1, 0, 1), still(1, 0, 1), still(0, -1, 0), still(0, 1, 0)};

TEST(Impact, FindsTheTimeAtWhichAVertexReachesAFace) {
    Motion x = above_face;
    x[0] = moved(x[0], {0, 0, -2});
    const Impact touching = feature_impact(FeatureKind::vertex_face, x),
                 near = feature_impact(FeatureKind::vertex_face, x, {.separation = 0.2});
    EXPECT_TRUE(touching.hits);
    EXPECT_NEAR(touching.time, 0.5, 1e-12);
    EXPECT_TRUE(near.hits);
    EXPECT_NEAR(near.time, 0.4, 1e-12);
    EXPECT_FALSE(feature_impact(FeatureKind::vertex_face, above_face).hits);
}

TEST(Impact, FindsTheTimeAtWhichEdgesCross) {
    Motion x = crossed_edges;
    for (const std::size_t k : {0u, 1u}) x[k] = moved(x[k], {0, 0, -4});
    const Impact impact = feature_impact(FeatureKind::edge_edge, x);
    EXPECT_TRUE(impact.hits);
    EXPECT_NEAR(impact.time, 0.25, 1e-12);
    EXPECT_FALSE(feature_impact(FeatureKind::edge_edge, crossed_edges).hits);
}

TEST(Impact, LetsFeaturesPassBesideEachOther) {
    Motion x = above_face;
    x[0] = moved(still(1.2, 0.2, 1), {0, 0, -2});
    const Impact impact = feature_impact(FeatureKind::vertex_face, x);
    EXPECT_FALSE(impact.hits);
    EXPECT_EQ(impact.time, 1);
    EXPECT_TRUE(feature_impact(FeatureKind::vertex_face, x, {.separation = 0.4}).hits);
}

TEST(Impact, FindsFeaturesThatTurnWhileTheyMove) {
    // The face turns about the y axis into the vertex, which stays.
    Motion x{still(0.5, 0.1, 0.5), still(0, -1, 0), still(0, 1, 0), {{1, 0, -1}, {0.5, 0, 2}}};
    const Impact impact = feature_impact(FeatureKind::vertex_face, x);
    ASSERT_TRUE(impact.hits);
    EXPECT_NEAR(distance_at(FeatureKind::vertex_face, x, impact.time), 0, 1e-9);
}

TEST(Impact, NeverMissesOrComesLateOnRandomMotion) {
    constexpr int queries = 20000, samples = 64;
    int certain = 0, reported = 0;
    double early = 0;
    for (int q = 0; q < queries; ++q) {
        CounterRandom random(7, static_cast<std::uint64_t>(q));
        // Far from the origin, and small, in some of the queries.
        const double size = q % 3 == 0 ? 1e-6 : 1, offset = q % 5 == 0 ? 1e3 * size : 0;
        Motion x;
        const auto point = [&]() -> Vector3d {
            return size * Vector3d(random.unit(), random.unit(), random.unit()) + Vector3d::Constant(offset);
        };
        for (MovingPoint& corner : x) corner = {point(), point()};
        const FeatureKind kind = q % 2 == 0 ? FeatureKind::vertex_face : FeatureKind::edge_edge;
        const double separation = size * random.uniform(0.001, 0.02);
        const Impact impact = feature_impact(kind, x, {.separation = separation, .tolerance = 1e-6 * size});
        reported += impact.hits;
        if (impact.time > 0) {
            ASSERT_GE(distance_at(kind, x, impact.time), separation * (1 - 1e-9)) << q;
        }
        for (int s = 0; s <= samples; ++s) {
            const double time = static_cast<double>(s) / samples;
            if (distance_at(kind, x, time) >= separation) continue;
            ++certain;
            ASSERT_TRUE(impact.hits) << q;
            ASSERT_LE(impact.time, time) << q;
            early += time - impact.time;
            break;
        }
    }
    EXPECT_GT(certain, queries / 20);
    EXPECT_LT(certain, queries / 2);
    EXPECT_LT(reported, 1.3 * certain);
    EXPECT_LT(early / certain, 2.0 / samples);
}

/// Whole numbers, so that positions and their differences are exact.
Vector3d whole(CounterRandom& random, int most) {
    Vector3d x;
    for (int axis = 0; axis < 3; ++axis) x[axis] = std::floor(random.uniform(-most, most + 1));
    return x;
}

TEST(Impact, ReportsFeaturesThatJustTouchAtTheEnd) {
    constexpr int queries = 4000;
    for (int q = 0; q < queries; ++q) {
        CounterRandom random(11, static_cast<std::uint64_t>(q));
        const FeatureKind kind = q % 2 == 0 ? FeatureKind::vertex_face : FeatureKind::edge_edge;
        std::array<Vector3d, 4> end;
        if (kind == FeatureKind::vertex_face) {
            for (const std::size_t k : {1u, 2u, 3u}) end[k] = 4 * whole(random, 30);
            end[0] = (2 * end[1] + end[2] + end[3]) / 4;
        } else {
            const Vector3d common = whole(random, 30), d = whole(random, 9), e = whole(random, 9);
            end = {common - 3 * d, common + 2 * d, common - 5 * e, common + 4 * e};
        }
        const Vector3d offset = q % 3 == 0 ? whole(random, 1 << 20) : Vector3d::Zero();
        Motion x;
        for (std::size_t k = 0; k < 4; ++k)
            x[k] = {end[k] + whole(random, q % 5 == 0 ? 3000 : 30) + offset, end[k] + offset};
        ASSERT_TRUE(feature_impact(kind, x).hits) << q;
    }
}

/// Features that slide along both sides of a plane and come to `gap` of each other, of size 1. The closest
/// points lie inside of a face or of both edges, or of a vertex and an edge of its face.
enum class Passing { over_face, over_edge, edges };

int reported_passings(Passing passing, double gap, int queries) {
    int reported = 0;
    for (int q = 0; q < queries; ++q) {
        CounterRandom random(3, static_cast<std::uint64_t>(q));
        const auto vector = [&] {
            return Vector3d(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
        };
        const Vector3d n = vector().normalized();
        const auto along = [&]() -> Vector3d {
            const Vector3d v = vector();
            return v - n * n.dot(v);
        };
        const Vector3d a = along(), b = along(), c = along(), up = gap * n;
        std::array<Vector3d, 4> middle;
        if (passing == Passing::over_face)
            middle = {up + 0.4 * a + 0.3 * b + 0.3 * c, a, b, c};
        else if (passing == Passing::over_edge)
            middle = {up + 0.3 * a, a, -a, b - n};
        else
            middle = {up + a, up - a, b, -b};
        Motion x;
        for (std::size_t k = 0; k < 4; ++k) {
            const Vector3d half = along() / 2;
            x[k] = {middle[k] - half, middle[k] + half};
        }
        const FeatureKind kind =
            passing == Passing::edges ? FeatureKind::edge_edge : FeatureKind::vertex_face;
        const Impact impact = feature_impact(kind, x);
        reported += impact.hits && !impact.exhausted;
    }
    return reported;
}

TEST(Impact, TellsFeaturesApartThatPassAtItsStatedDistances) {
    constexpr int queries = 2000;
    for (const Passing passing : {Passing::over_face, Passing::edges}) {
        EXPECT_EQ(reported_passings(passing, 1e-13, queries), 0);  // sizes are up to 3.5
        EXPECT_GT(reported_passings(passing, 1e-14, queries), queries / 2);
    }
    EXPECT_EQ(reported_passings(Passing::over_edge, 2e-8, queries), 0);
    EXPECT_GT(reported_passings(Passing::over_edge, 1e-10, queries), queries / 2);
}

TEST(Impact, SaysThatItsIterationsRanOut) {
    // These edges keep 7e-4 of their size apart.
    const Motion x{MovingPoint{{0, 1, 2}, {-2, -1, -2}}, MovingPoint{{2, -1, -1}, {2, 2, -2}},
                   MovingPoint{{1, -1, -2}, {1, 2, 1}}, MovingPoint{{2, 2, 2}, {1, -1, 1}}};
    const Impact few = feature_impact(FeatureKind::edge_edge, x, {.max_iterations = 64});
    EXPECT_TRUE(few.hits);
    EXPECT_TRUE(few.exhausted);
    EXPECT_EQ(few.iterations, 64);
    EXPECT_LT(few.time, 0.5);
    const Impact impact = feature_impact(FeatureKind::edge_edge, x);
    EXPECT_FALSE(impact.hits);
    EXPECT_FALSE(impact.exhausted);
    EXPECT_EQ(impact.time, 1);
    EXPECT_GT(impact.iterations, 64);
    double nearest = 1e30;
    for (int s = 0; s <= 100000; ++s)
        nearest = std::min(nearest, distance_at(FeatureKind::edge_edge, x, s * 1e-5));
    EXPECT_GT(nearest, 2e-3);  // of 4.6
    EXPECT_LT(nearest, 5e-3);
    // What surely hits does not run out.
    const MovingPoint falling = moved(still(0.2, 0.2, 1), {0, 0, -2});
    EXPECT_FALSE(vertex_face_impact(falling, above_face[1], above_face[2], above_face[3]).exhausted);
}

/// Numbers of any size, denormal ones too.
TEST(Impact, MissesNothingInAnyUnit) {
    int told_apart = 0;
    for (int exponent = -1074; exponent <= 1020; exponent += 3) {
        const double unit = std::ldexp(1, exponent);
        const auto scaled = [&](Motion x) {
            for (MovingPoint& p : x) p = {unit * p.begin, unit * p.end};
            return x;
        };
        Motion into = above_face, beside = above_face;
        into[0] = {{1, 1, 4}, {1, 1, 0}};  // touches at the end
        into[2] = still(4, 0, 0), into[3] = still(0, 4, 0);
        beside[0] = moved(still(3, 1, 1), {0, 0, -2});
        EXPECT_TRUE(feature_impact(FeatureKind::vertex_face, scaled(into)).hits) << exponent;
        Motion crossing = crossed_edges;
        for (const std::size_t k : {0u, 1u}) crossing[k] = moved(crossing[k], {0, 0, -2});
        EXPECT_TRUE(feature_impact(FeatureKind::edge_edge, scaled(crossing)).hits) << exponent;
        // Directions without digits must not stretch distances.
        EXPECT_TRUE(feature_impact(FeatureKind::vertex_face, scaled(beside), {.separation = 2.3 * unit}).hits)
            << exponent;
        const bool apart = !feature_impact(FeatureKind::vertex_face, scaled(beside)).hits &&
                           !feature_impact(FeatureKind::edge_edge, scaled(crossed_edges)).hits;
        told_apart += apart;
        EXPECT_TRUE(apart || std::abs(exponent) > 230) << exponent;  // 1e-70 to 1e70
    }
    EXPECT_GT(told_apart, 200);
    EXPECT_LT(told_apart, 690);
}

TEST(Impact, HoldsForDegenerateFeatures) {
    const MovingPoint falling = moved(still(0.2, 0, 1), {0, 0, -2});
    const MovingPoint a = still(0, 0, 0), b = still(1, 0, 0), aside = still(0.2, 1, 0);
    // A face without area is a segment, and one whose corners are equal a point.
    EXPECT_TRUE(vertex_face_impact(falling, a, b, a).hits);
    EXPECT_TRUE(vertex_face_impact(falling, a, b, still(0.5, 0, 0)).hits);
    EXPECT_TRUE(vertex_face_impact(falling, still(0.2, 0, 0), still(0.2, 0, 0), still(0.2, 0, 0)).hits);
    EXPECT_FALSE(vertex_face_impact(falling, aside, aside, aside).hits);
    EXPECT_TRUE(edge_edge_impact(falling, falling, a, b).hits);
    EXPECT_FALSE(edge_edge_impact(falling, falling, aside, aside).hits);
    EXPECT_TRUE(edge_edge_impact(a, b, b, a).hits);
    // Parallel edges, one of which slides along the other at a distance.
    const Motion sliding{moved(still(-3, 0, 0.1), {6, 0, 0}), moved(still(-2, 0, 0.1), {6, 0, 0}), a, b};
    EXPECT_FALSE(feature_impact(FeatureKind::edge_edge, sliding).hits);
    EXPECT_TRUE(feature_impact(FeatureKind::edge_edge, sliding, {.separation = 0.11}).hits);
    // A vertex that slides within the face's plane into its edge.
    const Impact slide = vertex_face_impact(moved(still(-1, 0.2, 0), {1.5, 0, 0}), a, b, still(0, 1, 0));
    EXPECT_TRUE(slide.hits);
    EXPECT_NEAR(slide.time, 2.0 / 3, 1e-9);
}

TEST(Impact, HitsAtOnceWhereFeaturesTouchAtTheStart) {
    EXPECT_EQ(vertex_face_impact(still(0.2, 0.2, 0), still(0, 0, 0), still(1, 0, 0), still(0, 1, 0)).time, 0);
    EXPECT_TRUE(edge_edge_impact(still(0, 0, 0), still(1, 0, 0), still(1, 0, 0), still(1, 1, 0)).hits);
}

TEST(Impact, HitsWhereItCannotDecide) {
    Motion x{still(0.5, 0.1, 0.5), still(0, -1, 0), still(0, 1, 0), {{1, 0, -1}, {0.5, 0, 2}}};
    const Impact one = feature_impact(FeatureKind::vertex_face, x, {.max_iterations = 1});
    EXPECT_TRUE(one.hits);
    EXPECT_GT(distance_at(FeatureKind::vertex_face, x, one.time), 0);
    for (const double bad :
         {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()})
        for (std::size_t k = 0; k < 4; ++k) {
            Motion y = above_face;
            y[k].end[1] = bad;
            EXPECT_TRUE(feature_impact(FeatureKind::vertex_face, y).hits);
            EXPECT_EQ(feature_impact(FeatureKind::edge_edge, y).time, 0);
        }
}

}  // namespace
}  // namespace nbd
