#include <CGAL/Exact_predicates_exact_constructions_kernel.h>
#include <CGAL/squared_distance_3.h>
#include <gtest/gtest.h>

#include "collision/base/counter_random.hpp"
#include "tests/differential/compare.hpp"
#include "tests/differential/exact_grid.hpp"

namespace nbd::test {
namespace {

using Kernel = CGAL::Exact_predicates_exact_constructions_kernel;

GridTriangle proper_triangle(CounterRandom& random, int width) {
    for (;;) {
        GridTriangle t;
        for (GridPoint& p : t)
            for (int i = 0; i < 3; ++i) p[i] = random.index(width + 1);
        if (!(t[1] - t[0]).cross(t[2] - t[0]).isZero(0)) return t;
    }
}

Kernel::Triangle_3 cgal(const GridTriangle& t) {
    const auto point = [](const GridPoint& p) {
        return Kernel::Point_3(static_cast<double>(p.x()), static_cast<double>(p.y()),
                               static_cast<double>(p.z()));
    };
    return {point(t[0]), point(t[1]), point(t[2])};
}

TEST(ExactGrid, AgreesWithCgalOnTriangles) {
    int hits = 0;
    for (std::uint64_t i = 0; i < 20000; ++i) {
        CounterRandom random(5, i);
        const int width = 1 + random.index(8);
        const GridTriangle s = proper_triangle(random, width), t = proper_triangle(random, width);
        const bool expected = CGAL::do_intersect(cgal(s), cgal(t));
        hits += expected;
        ASSERT_EQ(grid_triangles_intersect(s, t), expected) << "case " << i;
    }
    EXPECT_GT(hits, 4000);
    EXPECT_LT(hits, 16000);
}

TEST(ExactGrid, AgreesWithCgalOnDistances) {
    int apart = 0;
    for (std::uint64_t i = 0; i < 3000; ++i) {
        CounterRandom random(6, i);
        const int width = 2 + random.index(7);
        const GridTriangle s = proper_triangle(random, width), t = proper_triangle(random, width);
        const double square = CGAL::to_double(CGAL::squared_distance(cgal(s).vertex(0), cgal(t)));
        apart += square > 0;
        ASSERT_NEAR(grid_point_triangle(s[0], t), square, 1e-12) << "case " << i;
        const Kernel::Segment_3 a(cgal(s).vertex(0), cgal(s).vertex(1)),
            b(cgal(t).vertex(0), cgal(t).vertex(1));
        ASSERT_NEAR(grid_edge_edge(s[0], s[1], t[0], t[1]), CGAL::to_double(CGAL::squared_distance(a, b)),
                    1e-12)
            << "case " << i;
    }
    EXPECT_GT(apart, 2000);
}

void expect_no_difference(const Comparison& comparison) {
    EXPECT_EQ(comparison.different, 0) << comparison.first;
    EXPECT_GT(comparison.hits, comparison.cases / 10);
    EXPECT_LT(comparison.hits, comparison.cases * 95 / 100);
}

TEST(Differential, TrianglesAgreeWithExactGeometry) {
    const Comparison comparison = compare_triangles(1, 300000);
    expect_no_difference(comparison);
    EXPECT_GT(comparison.degenerate, comparison.cases / 100);
}

TEST(Differential, DistancesAgreeWithExactGeometry) {
    const Comparison comparison = compare_distances(1, 200000);
    expect_no_difference(comparison);
    EXPECT_GT(comparison.degenerate, comparison.cases / 100);
}

TEST(Differential, QueriesAgreeWithExactGeometry) { expect_no_difference(compare_queries(1, 20000)); }

}  // namespace
}  // namespace nbd::test
