// Compares triangle-triangle intersection with CGAL's exact predicates, an independent implementation.
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/intersections.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>
#include <variant>

#include "collision/geometry/triangle_triangle.hpp"
#include "tests/support/random_triangles.hpp"

namespace nbd {
namespace {

using Eigen::Vector3f;
using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Point = Kernel::Point_3;
using Shape = std::variant<Point, Kernel::Segment_3, Kernel::Triangle_3>;

/// CGAL's predicates need the right dimension: a degenerate triangle becomes a segment or a point.
Shape shape_of(const Triangle& t) {
    const auto point = [](const Vector3f& x) { return Point(x.x(), x.y(), x.z()); };
    std::array<Point, 3> p{point(t.a), point(t.b), point(t.c)};
    if (!CGAL::collinear(p[0], p[1], p[2])) return Kernel::Triangle_3(p[0], p[1], p[2]);
    std::sort(p.begin(), p.end());
    if (p[0] == p[2]) return p[0];
    return Kernel::Segment_3(p[0], p[2]);
}

bool oracle(const Shape& s, const Shape& t) {
    return std::visit([](const auto& a, const auto& b) { return CGAL::do_intersect(a, b); }, s, t);
}

struct Tally {
    int pairs = 0, hits = 0, degenerate = 0;
};

class TriangleOracle : public testing::Test {
 protected:
    /// Compares `pairs` pairs from make(), in both orders.
    template <typename Make>
    Tally compare(int pairs, Make&& make) {
        Tally tally;
        for (; tally.pairs < pairs; ++tally.pairs) {
            const auto [s, t] = make();
            const Shape a = shape_of(s), b = shape_of(t);
            const bool expected = oracle(a, b);
            tally.hits += expected;
            tally.degenerate += a.index() < 2 || b.index() < 2;
            if (triangles_intersect(s, t) != expected || triangles_intersect(t, s) != expected) {
                ADD_FAILURE() << "pair " << tally.pairs << ": CGAL says " << expected << std::hexfloat << "\n"
                              << s.a.transpose() << ", " << s.b.transpose() << ", " << s.c.transpose() << "\n"
                              << t.a.transpose() << ", " << t.b.transpose() << ", " << t.c.transpose();
                break;
            }
        }
        return tally;
    }

    RandomTriangles random_{11};
};

TEST_F(TriangleOracle, AgreesOnRandomTriangles) {
    const Tally t = compare(400000, [&] { return std::pair{random_.triangle(), random_.triangle()}; });
    EXPECT_GT(t.hits, t.pairs / 10);
    EXPECT_LT(t.hits, t.pairs / 2);
    EXPECT_EQ(t.degenerate, 0);
}

TEST_F(TriangleOracle, AgreesOnSmallIntegerGrids) {
    for (const int size : {1, 2, 3, 6}) {
        const Tally t = compare(150000, [&] {
            return std::pair{random_.grid_triangle(size), random_.grid_triangle(size)};
        });
        EXPECT_GT(t.hits, t.pairs / 10);
        EXPECT_LT(t.hits, t.pairs * 9 / 10);
        EXPECT_GT(t.degenerate, t.pairs / 100);
    }
}

TEST_F(TriangleOracle, AgreesOnCoplanarTriangles) {
    const Tally t = compare(150000, [&] {
        const Vector3f origin = random_.grid_point(9), u = random_.grid_step(6), v = random_.grid_step(6);
        const auto point = [&]() -> Vector3f {
            const int i = random_.integer(-4, 4);
            return origin + float(i) * u + float(random_.integer(-4, 4)) * v;
        };
        return std::pair(Triangle{point(), point(), point()}, Triangle{point(), point(), point()});
    });
    EXPECT_GT(t.hits, t.pairs / 10);
    EXPECT_LT(t.hits, t.pairs * 9 / 10);
}

TEST_F(TriangleOracle, AgreesOnNearlyTouchingTriangles) {
    const Tally t = compare(200000, [&] {
        const Triangle s = random_.triangle();
        return std::pair(s, random_.nearly_touching(s));
    });
    EXPECT_GT(t.hits, t.pairs / 4);
    EXPECT_LT(t.hits, t.pairs * 3 / 4);
}

TEST_F(TriangleOracle, AgreesFarFromTheOrigin) {
    const Tally t = compare(100000, [&] {
        const auto point = [&]() -> Vector3f {
            return Vector3f(0x1p20f, -0x1p21f, 0x1.8p20f) + random_.grid_point(24) / 8;
        };
        return std::pair(Triangle{point(), point(), point()}, Triangle{point(), point(), point()});
    });
    EXPECT_GT(t.hits, t.pairs / 10);
    EXPECT_LT(t.hits, t.pairs / 2);
}

TEST_F(TriangleOracle, AgreesOnTinyTriangles) {
    const Tally t = compare(100000, [&] {  // small multiples of the smallest float
        const float unit = std::numeric_limits<float>::denorm_min();
        const auto point = [&]() -> Vector3f { return random_.grid_point(5) * unit; };
        return std::pair(Triangle{point(), point(), point()}, Triangle{point(), point(), point()});
    });
    EXPECT_GT(t.hits, t.pairs / 10);
    EXPECT_LT(t.hits, t.pairs * 9 / 10);
}

TEST_F(TriangleOracle, AgreesOnMixedScales) {
    const Tally t = compare(60000, [&] {
        const auto coordinate = [&] {
            return std::ldexp(random_.uniform() - 0.5f, random_.integer(-40, 40));
        };
        const auto point = [&] {
            const float x = coordinate(), y = coordinate();
            return Vector3f(x, y, coordinate());
        };
        Triangle s{point(), point(), point()}, t{point(), point(), point()};
        if (random_.integer(0, 3) == 0) t.a = s.c;
        if (random_.integer(0, 3) == 0) t.b = (s.a + s.b) / 2;
        return std::pair(s, t);
    });
    EXPECT_GT(t.hits, t.pairs / 10);
    EXPECT_LT(t.hits, t.pairs * 9 / 10);
}

TEST_F(TriangleOracle, AgreesOnSegmentsAndPoints) {
    const Tally t = compare(200000, [&] {
        // Proper or collapsed triangles with corners on shared lines.
        const Vector3f o = random_.grid_point(4), u = random_.grid_step(3), v = random_.grid_step(3);
        const auto on_line = [&]() -> Vector3f { return o + float(random_.integer(-2, 2)) * u; };
        const auto on_plane = [&]() -> Vector3f { return on_line() + float(random_.integer(-1, 1)) * v; };
        Triangle s{on_line(), on_line(), on_line()};
        if (random_.integer(0, 3) == 0) s.b = s.a;
        switch (random_.integer(0, 3)) {
            case 0:
                return std::pair(s, Triangle{on_line(), on_line(), on_line()});
            case 1:
                return std::pair(s, Triangle{on_plane(), on_plane(), on_plane()});
            case 2:
                return std::pair(s, Triangle{on_plane(), on_plane(), random_.grid_point(4)});
            default:
                return std::pair(
                    s, Triangle{random_.grid_point(4), random_.grid_point(4), random_.grid_point(4)});
        }
    });
    EXPECT_GT(t.hits, t.pairs / 10);
    EXPECT_LT(t.hits, t.pairs * 9 / 10);
    EXPECT_GT(t.degenerate, t.pairs * 9 / 10);
}

}  // namespace
}  // namespace nbd
