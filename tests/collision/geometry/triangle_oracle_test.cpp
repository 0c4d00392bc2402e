// Compares triangle-triangle intersection with CGAL's exact predicates, an independent implementation.
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/intersections.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <utility>
#include <variant>
#include <vector>

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

/// Pairs of one sort, and what shares of them must intersect and be degenerate, so that the case is not
/// vacuous.
struct Sort {
    const char* name;
    int pairs;
    double least_hits, most_hits, least_degenerate, most_degenerate;
    std::function<std::pair<Triangle, Triangle>()> make;
};

std::vector<Sort> sorts(RandomTriangles& random) {
    const auto of_points = [](const auto& point) {
        const Triangle s{point(), point(), point()};
        return std::pair(s, Triangle{point(), point(), point()});
    };
    return {
        {"random", 400000, 0.1, 0.5, 0, 0,
         [&] {
             const Triangle s = random.triangle();
             return std::pair(s, random.triangle());
         }},
        {"coplanar", 150000, 0.1, 0.9, 0, 1,
         [&, of_points] {
             const Vector3f origin = random.grid_point(9), u = random.grid_step(6), v = random.grid_step(6);
             return of_points([&]() -> Vector3f {
                 const int i = random.integer(-4, 4);
                 return origin + float(i) * u + float(random.integer(-4, 4)) * v;
             });
         }},
        {"nearly touching", 200000, 0.25, 0.75, 0, 1,
         [&] {
             const Triangle s = random.triangle();
             return std::pair(s, random.nearly_touching(s));
         }},
        {"far from the origin", 100000, 0.1, 0.5, 0, 1,
         [&, of_points] {
             return of_points([&]() -> Vector3f {
                 return Vector3f(0x1p20f, -0x1p21f, 0x1.8p20f) + random.grid_point(24) / 8;
             });
         }},
        {"tiny", 100000, 0.1, 0.9, 0, 1,
         [&, of_points] {  // small multiples of the smallest float
             return of_points([&]() -> Vector3f {
                 return random.grid_point(5) * std::numeric_limits<float>::denorm_min();
             });
         }},
        {"of mixed scales", 60000, 0.1, 0.9, 0, 1,
         [&, of_points] {
             const auto coordinate = [&] {
                 return std::ldexp(random.uniform() - 0.5f, random.integer(-40, 40));
             };
             auto [s, t] = of_points([&] {
                 const float x = coordinate(), y = coordinate();
                 return Vector3f(x, y, coordinate());
             });
             if (random.integer(0, 3) == 0) t.a = s.c;
             if (random.integer(0, 3) == 0) t.b = (s.a + s.b) / 2;
             return std::pair(s, t);
         }},
        {"segments and points", 200000, 0.1, 0.9, 0.9, 1, [&] {
             // Proper or collapsed triangles with corners on shared lines.
             const Vector3f o = random.grid_point(4), u = random.grid_step(3), v = random.grid_step(3);
             const auto on_line = [&]() -> Vector3f { return o + float(random.integer(-2, 2)) * u; };
             const auto on_plane = [&]() -> Vector3f { return on_line() + float(random.integer(-1, 1)) * v; };
             const auto anywhere = [&]() -> Vector3f { return random.grid_point(4); };
             Triangle s{on_line(), on_line(), on_line()};
             if (random.integer(0, 3) == 0) s.b = s.a;
             switch (random.integer(0, 3)) {
                 case 0:
                     return std::pair(s, Triangle{on_line(), on_line(), on_line()});
                 case 1:
                     return std::pair(s, Triangle{on_plane(), on_plane(), on_plane()});
                 case 2:
                     return std::pair(s, Triangle{on_plane(), on_plane(), anywhere()});
                 default:
                     return std::pair(s, Triangle{anywhere(), anywhere(), anywhere()});
             }
         }}};
}

/// In both orders. test_differential has small integer grids, against an oracle of its own.
TEST(TriangleOracle, AgreesWithCgal) {
    RandomTriangles random(11);
    for (const Sort& sort : sorts(random)) {
        SCOPED_TRACE(sort.name);
        int hits = 0, degenerate = 0;
        for (int i = 0; i < sort.pairs; ++i) {
            const auto [s, t] = sort.make();
            const Shape a = shape_of(s), b = shape_of(t);
            const bool expected = oracle(a, b);
            hits += expected;
            degenerate += a.index() < 2 || b.index() < 2;
            ASSERT_TRUE(triangles_intersect(s, t) == expected && triangles_intersect(t, s) == expected)
                << "pair " << i << ": CGAL says " << expected << std::hexfloat << "\n"
                << s.a.transpose() << ", " << s.b.transpose() << ", " << s.c.transpose() << "\n"
                << t.a.transpose() << ", " << t.b.transpose() << ", " << t.c.transpose();
        }
        EXPECT_GT(hits, sort.least_hits * sort.pairs);
        EXPECT_LT(hits, sort.most_hits * sort.pairs);
        EXPECT_GE(degenerate, sort.least_degenerate * sort.pairs);
        EXPECT_LE(degenerate, sort.most_degenerate * sort.pairs);
    }
}

}  // namespace
}  // namespace nbd
