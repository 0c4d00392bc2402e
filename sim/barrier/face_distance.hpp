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
    using Corners = std::array<Eigen::Vector3d, 3>;
    const Corners x{at(a[0]), at(a[1]), at(a[2])}, y{at(b[0]), at(b[1]), at(b[2])};
    double least = std::numeric_limits<double>::infinity();
    // The gap between two boxes along an axis tells at less cost that features are no nearer.
    const auto may_be_nearer = [&](const auto& low_s, const auto& high_s, const auto& low_t,
                                   const auto& high_t) {
        return (low_s - high_t).cwiseMax(low_t - high_s).maxCoeff() < least;
    };
    const auto vertices = [&](const std::array<int, 3>& s, const Corners& p, const std::array<int, 3>& t,
                              const Corners& q) {
        const Eigen::Vector3d low = q[0].cwiseMin(q[1]).cwiseMin(q[2]),
                              high = q[0].cwiseMax(q[1]).cwiseMax(q[2]);
        for (std::size_t i = 0; i < 3; ++i)
            if (std::ranges::find(t, s[i]) == t.end() && may_be_nearer(p[i], p[i], low, high))
                least = std::min(least, closest_point_triangle(p[i], q[0], q[1], q[2]).distance);
    };
    vertices(a, x, b, y);
    vertices(b, y, a, x);
    for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t j = 0; j < 3; ++j) {
            const std::size_t k = (i + 1) % 3, l = (j + 1) % 3;
            if (a[i] == b[j] || a[i] == b[l] || a[k] == b[j] || a[k] == b[l]) continue;
            if (may_be_nearer(x[i].cwiseMin(x[k]), x[i].cwiseMax(x[k]), y[j].cwiseMin(y[l]),
                              y[j].cwiseMax(y[l])))
                least = std::min(least, closest_edge_edge(x[i], x[k], y[j], y[l]).distance);
        }
    return least;
}

}  // namespace nbd
