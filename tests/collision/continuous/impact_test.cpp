#include "collision/continuous/impact.hpp"

#include <gtest/gtest.h>

#include <array>
#include <limits>

#include "collision/base/counter_random.hpp"
#include "collision/geometry/closest_points.hpp"

namespace nbd {
namespace {

using Eigen::Vector3d;
using Motion = std::array<MovingPoint, 4>;

enum class ImpactKind { vertex_face, edge_edge };

MovingPoint still(double x, double y, double z) { return {{x, y, z}, {x, y, z}}; }

MovingPoint moved(const MovingPoint& p, const Vector3d& by) { return {p.begin, p.end + by}; }

Impact find_impact(ImpactKind kind, const Motion& x, const ImpactConfig& config = {}) {
    return kind == ImpactKind::vertex_face ? vertex_face_impact(x[0], x[1], x[2], x[3], config)
                                           : edge_edge_impact(x[0], x[1], x[2], x[3], config);
}

double distance_at(ImpactKind kind, const Motion& x, double time) {
    std::array<Vector3d, 4> y;
    for (std::size_t k = 0; k < 4; ++k) y[k] = (1 - time) * x[k].begin + time * x[k].end;
    return kind == ImpactKind::vertex_face ? closest_point_triangle(y[0], y[1], y[2], y[3]).distance
                                           : closest_edge_edge(y[0], y[1], y[2], y[3]).distance;
}

const Motion above_face{still(0.2, 0.2, 1), still(0, 0, 0), still(1, 0, 0), still(0, 1, 0)};
const Motion crossed_edges{still(-1, 0, 1), still(1, 0, 1), still(0, -1, 0), still(0, 1, 0)};

TEST(Impact, FindsTheTimeAtWhichAVertexReachesAFace) {
    Motion x = above_face;
    x[0] = moved(x[0], {0, 0, -2});
    const Impact touching = find_impact(ImpactKind::vertex_face, x),
                 near = find_impact(ImpactKind::vertex_face, x, {.separation = 0.2});
    EXPECT_TRUE(touching.hits);
    EXPECT_NEAR(touching.time, 0.5, 1e-12);
    EXPECT_TRUE(near.hits);
    EXPECT_NEAR(near.time, 0.4, 1e-12);
    EXPECT_FALSE(find_impact(ImpactKind::vertex_face, above_face).hits);
}

TEST(Impact, FindsTheTimeAtWhichEdgesCross) {
    Motion x = crossed_edges;
    for (const std::size_t k : {0u, 1u}) x[k] = moved(x[k], {0, 0, -4});
    const Impact impact = find_impact(ImpactKind::edge_edge, x);
    EXPECT_TRUE(impact.hits);
    EXPECT_NEAR(impact.time, 0.25, 1e-12);
    EXPECT_FALSE(find_impact(ImpactKind::edge_edge, crossed_edges).hits);
}

TEST(Impact, LetsFeaturesPassBesideEachOther) {
    Motion x = above_face;
    x[0] = moved(still(1.2, 0.2, 1), {0, 0, -2});
    const Impact impact = find_impact(ImpactKind::vertex_face, x);
    EXPECT_FALSE(impact.hits);
    EXPECT_EQ(impact.time, 1);
    EXPECT_TRUE(find_impact(ImpactKind::vertex_face, x, {.separation = 0.4}).hits);
}

TEST(Impact, FindsFeaturesThatTurnWhileTheyMove) {
    // The face turns about the y axis into the vertex, which stays.
    Motion x{still(0.5, 0.1, 0.5), still(0, -1, 0), still(0, 1, 0), {{1, 0, -1}, {0.5, 0, 2}}};
    const Impact impact = find_impact(ImpactKind::vertex_face, x);
    ASSERT_TRUE(impact.hits);
    EXPECT_NEAR(distance_at(ImpactKind::vertex_face, x, impact.time), 0, 1e-9);
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
        const ImpactKind kind = q % 2 == 0 ? ImpactKind::vertex_face : ImpactKind::edge_edge;
        const double separation = size * random.uniform(0.001, 0.02);
        const Impact impact = find_impact(kind, x, {.separation = separation, .tolerance = 1e-6 * size});
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
    EXPECT_FALSE(find_impact(ImpactKind::edge_edge, sliding).hits);
    EXPECT_TRUE(find_impact(ImpactKind::edge_edge, sliding, {.separation = 0.11}).hits);
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
    const Impact one = find_impact(ImpactKind::vertex_face, x, {.max_iterations = 1});
    EXPECT_TRUE(one.hits);
    EXPECT_GT(distance_at(ImpactKind::vertex_face, x, one.time), 0);
    for (const double bad :
         {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()})
        for (std::size_t k = 0; k < 4; ++k) {
            Motion y = above_face;
            y[k].end[1] = bad;
            EXPECT_TRUE(find_impact(ImpactKind::vertex_face, y).hits);
            EXPECT_EQ(find_impact(ImpactKind::edge_edge, y).time, 0);
        }
}

}  // namespace
}  // namespace nbd
