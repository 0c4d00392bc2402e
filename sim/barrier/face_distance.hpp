#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <limits>

#include "collision/geometry/closest_points.hpp"

namespace nbd {

/// Distance of the features of two faces, by their vertices, that have no vertex in common, metres; infinite
/// if all have. at(vertex): its position, Eigen::Vector3d.
template <class Position>
double face_distance(const std::array<int, 3>& a, const std::array<int, 3>& b, const Position& at) {
    double least = std::numeric_limits<double>::infinity();
    const auto vertices = [&](const std::array<int, 3>& s, const std::array<int, 3>& t) {
        for (const int v : s)
            if (std::ranges::find(t, v) == t.end())
                least = std::min(least, closest_point_triangle(at(v), at(t[0]), at(t[1]), at(t[2])).distance);
    };
    vertices(a, b);
    vertices(b, a);
    for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t j = 0; j < 3; ++j) {
            const std::array<int, 4> e{a[i], a[(i + 1) % 3], b[j], b[(j + 1) % 3]};
            if (e[0] == e[2] || e[0] == e[3] || e[1] == e[2] || e[1] == e[3]) continue;
            least = std::min(least, closest_edge_edge(at(e[0]), at(e[1]), at(e[2]), at(e[3])).distance);
        }
    return least;
}

}  // namespace nbd
