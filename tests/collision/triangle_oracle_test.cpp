// Triangle-triangle intersection against CGAL's exact predicates, which share no code with ours.
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/intersections.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <variant>

#include "collision/triangle_triangle.hpp"

namespace nbd {
namespace {

using Eigen::Vector3f;
using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Point = Kernel::Point_3;
using Shape = std::variant<Point, Kernel::Segment_3, Kernel::Triangle_3>;

/// CGAL's predicates want the dimension named: a degenerate triangle is a segment or a point to them.
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
    int integer(int low, int high) { return low + static_cast<int>(random_() % (high - low + 1)); }
    float uniform() { return static_cast<float>(random_() >> 8) * 0x1p-24f; }
    Vector3f uniform_point() {
        const float x = uniform(), y = uniform();
        return {x, y, uniform()};
    }
    Vector3f grid_point(int high) {
        const int x = integer(0, high), y = integer(0, high);
        return Vector3f(x, y, integer(0, high));
    }
    /// x, moved by up to two ulp along each axis.
    Vector3f nudged(Vector3f x) {
        for (int i = 0; i < 3; ++i)
            for (int k = integer(0, 2); k > 0; --k)
                x[i] = std::nextafter(x[i], integer(0, 1) ? 1e30f : -1e30f);
        return x;
    }

    /// Compares `pairs` pairs that make() gives, in both orders.
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

    std::mt19937 random_{11};
};

TEST_F(TriangleOracle, AgreesOnRandomTriangles) {
    const Tally t = compare(400000, [&] {
        return std::pair(Triangle{uniform_point(), uniform_point(), uniform_point()},
                         Triangle{uniform_point(), uniform_point(), uniform_point()});
    });
    EXPECT_GT(t.hits, t.pairs / 10);
    EXPECT_LT(t.hits, t.pairs / 2);
    EXPECT_EQ(t.degenerate, 0);
}

TEST_F(TriangleOracle, AgreesOnSmallIntegerGrids) {
    for (const int size : {1, 2, 3, 6}) {
        const Tally t = compare(150000, [&] {
            return std::pair(Triangle{grid_point(size), grid_point(size), grid_point(size)},
                             Triangle{grid_point(size), grid_point(size), grid_point(size)});
        });
        EXPECT_GT(t.hits, t.pairs / 10);
        EXPECT_LT(t.hits, t.pairs * 9 / 10);
        EXPECT_GT(t.degenerate, t.pairs / 100);
    }
}

TEST_F(TriangleOracle, AgreesOnCoplanarTriangles) {
    const Tally t = compare(150000, [&] {
        const Vector3f origin = grid_point(9), u = grid_point(6) - grid_point(6),
                       v = grid_point(6) - grid_point(6);
        const auto point = [&]() -> Vector3f {
            const int i = integer(-4, 4);
            return origin + float(i) * u + float(integer(-4, 4)) * v;
        };
        return std::pair(Triangle{point(), point(), point()}, Triangle{point(), point(), point()});
    });
    EXPECT_GT(t.hits, t.pairs / 10);
    EXPECT_LT(t.hits, t.pairs * 9 / 10);
}

TEST_F(TriangleOracle, AgreesOnNearlyTouchingTriangles) {
    const Tally t = compare(200000, [&] {
        const Triangle s{uniform_point(), uniform_point(), uniform_point()};
        // A corner (and at times an edge) on a corner, an edge or the face of s, but for a few ulp.
        const auto near = [&] {
            const float u = integer(0, 3) ? uniform() : 0, v = integer(0, 2) ? uniform() : 1 - u;
            return nudged(s.a + u * (s.b - s.a) + (1 - u) * v * (s.c - s.a));
        };
        const Vector3f p = near(), q = integer(0, 2) ? uniform_point() : near();
        return std::pair(s, Triangle{p, q, uniform_point()});
    });
    EXPECT_GT(t.hits, t.pairs / 4);
    EXPECT_LT(t.hits, t.pairs * 3 / 4);
}

TEST_F(TriangleOracle, AgreesFarFromTheOrigin) {
    const Tally t = compare(100000, [&] {
        const auto point = [&]() -> Vector3f {
            return Vector3f(0x1p20f, -0x1p21f, 0x1.8p20f) + grid_point(24) / 8;
        };
        return std::pair(Triangle{point(), point(), point()}, Triangle{point(), point(), point()});
    });
    EXPECT_GT(t.hits, t.pairs / 10);
    EXPECT_LT(t.hits, t.pairs / 2);
}

TEST_F(TriangleOracle, AgreesOnTinyTriangles) {
    const Tally t = compare(100000, [&] {  // small multiples of the least float
        const float unit = std::numeric_limits<float>::denorm_min();
        const auto point = [&]() -> Vector3f { return grid_point(5) * unit; };
        return std::pair(Triangle{point(), point(), point()}, Triangle{point(), point(), point()});
    });
    EXPECT_GT(t.hits, t.pairs / 10);
    EXPECT_LT(t.hits, t.pairs * 9 / 10);
}

TEST_F(TriangleOracle, AgreesOnMixedScales) {
    const Tally t = compare(60000, [&] {
        const auto coordinate = [&] { return std::ldexp(uniform() - 0.5f, integer(-40, 40)); };
        const auto point = [&] {
            const float x = coordinate(), y = coordinate();
            return Vector3f(x, y, coordinate());
        };
        Triangle s{point(), point(), point()}, t{point(), point(), point()};
        if (integer(0, 3) == 0) t.a = s.c;
        if (integer(0, 3) == 0) t.b = (s.a + s.b) / 2;
        return std::pair(s, t);
    });
    EXPECT_GT(t.hits, t.pairs / 10);
    EXPECT_LT(t.hits, t.pairs * 9 / 10);
}

TEST_F(TriangleOracle, AgreesOnSegmentsAndPoints) {
    const Tally t = compare(200000, [&] {
        // A proper triangle or a collapsed one, with corners on lines that the other one knows too.
        const Vector3f o = grid_point(4), u = grid_point(3) - grid_point(3),
                       v = grid_point(3) - grid_point(3);
        const auto on_line = [&]() -> Vector3f { return o + float(integer(-2, 2)) * u; };
        const auto on_plane = [&]() -> Vector3f { return on_line() + float(integer(-1, 1)) * v; };
        Triangle s{on_line(), on_line(), on_line()};
        if (integer(0, 3) == 0) s.b = s.a;
        switch (integer(0, 3)) {
            case 0:
                return std::pair(s, Triangle{on_line(), on_line(), on_line()});
            case 1:
                return std::pair(s, Triangle{on_plane(), on_plane(), on_plane()});
            case 2:
                return std::pair(s, Triangle{on_plane(), on_plane(), grid_point(4)});
            default:
                return std::pair(s, Triangle{grid_point(4), grid_point(4), grid_point(4)});
        }
    });
    EXPECT_GT(t.hits, t.pairs / 10);
    EXPECT_LT(t.hits, t.pairs * 9 / 10);
    EXPECT_GT(t.degenerate, t.pairs * 9 / 10);
}

}  // namespace
}  // namespace nbd
