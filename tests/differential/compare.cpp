#include "tests/differential/compare.hpp"

#include <fmt/format.h>

#include <cmath>

#include "collision/base/counter_random.hpp"
#include "collision/geometry/closest_points.hpp"
#include "collision/geometry/triangle_triangle.hpp"
#include "tests/differential/exact_grid.hpp"

namespace nbd::test {
namespace {

GridPoint grid_point(CounterRandom& random, int width) {
    const int x = random.index(width + 1), y = random.index(width + 1);
    return {x, y, random.index(width + 1)};
}

GridTriangle grid_triangle(CounterRandom& random, int width) {
    const GridPoint a = grid_point(random, width), b = grid_point(random, width);
    return {a, b, grid_point(random, width)};
}

bool is_degenerate(const GridTriangle& t) { return (t[1] - t[0]).cross(t[2] - t[0]).isZero(0); }

Triangle in_float(const GridTriangle& t) {
    return {t[0].cast<float>(), t[1].cast<float>(), t[2].cast<float>()};
}

TriangleCorners in_double(const GridTriangle& t) {
    return {t[0].cast<double>(), t[1].cast<double>(), t[2].cast<double>()};
}

std::string words(const GridTriangle& t) {
    std::string text;
    for (const GridPoint& p : t) text += fmt::format("({} {} {})", p.x(), p.y(), p.z());
    return text;
}

void note(Comparison& comparison, const std::string& what) {
    if (comparison.different++ == 0) comparison.first = what;
}

/// A distance against its exact square, to a few roundings of a coordinate: the grid is at most 8 wide.
bool agree(double distance, double square) { return std::abs(distance - std::sqrt(square)) <= 1e-14 * 8; }

}  // namespace

Comparison compare_triangles(std::uint64_t seed, long cases) {
    Comparison comparison;
    for (; comparison.cases < cases; ++comparison.cases) {
        CounterRandom random(seed, comparison.cases);
        const int width = 1 + random.index(8);
        const GridTriangle s = grid_triangle(random, width), t = grid_triangle(random, width);
        const bool expected = grid_triangles_intersect(s, t);
        comparison.hits += expected;
        comparison.degenerate += is_degenerate(s) || is_degenerate(t);
        if (triangles_intersect(in_float(s), in_float(t)) != expected ||
            triangles_intersect(in_float(t), in_float(s)) != expected ||
            double_triangles_intersect(in_double(s), in_double(t)) != expected)
            note(comparison, fmt::format("case {}: {} and {}", comparison.cases, words(s), words(t)));
    }
    return comparison;
}

Comparison compare_distances(std::uint64_t seed, long cases) {
    Comparison comparison;
    for (; comparison.cases < cases; ++comparison.cases) {
        CounterRandom random(seed, comparison.cases);
        const int width = 1 + random.index(8);
        const GridTriangle s = grid_triangle(random, width), t = grid_triangle(random, width);
        const double square = grid_triangle_triangle(s, t);
        comparison.hits += square == 0;
        comparison.degenerate += is_degenerate(s) || is_degenerate(t);
        const TriangleCorners a = in_double(s), b = in_double(t);
        if (!agree(triangle_distance(in_float(s), in_float(t)), square) ||
            !agree(closest_point_triangle(a[0], b[0], b[1], b[2]).distance, grid_point_triangle(s[0], t)) ||
            !agree(closest_edge_edge(a[0], a[1], b[0], b[1]).distance,
                   grid_edge_edge(s[0], s[1], t[0], t[1])))
            note(comparison, fmt::format("case {}: {} and {}", comparison.cases, words(s), words(t)));
    }
    return comparison;
}

}  // namespace nbd::test
