#include "meshing/surface/vertex_gap.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace nbd {
namespace {

/// squared: lengths of the edges.
double gap_of_face(std::array<double, 3> squared) {
    std::ranges::sort(squared);
    const auto [a, b, c] = squared;
    if (!(a > 0)) return std::sqrt(c) / 2;
    if (a + b <= c) {
        // The farthest point lies on the longest edge, as far from one of its ends as from the obtuse corner.
        const double at_shorter = a * std::sqrt(c) / (a + c - b), at_longer = b * std::sqrt(c) / (b + c - a);
        return std::max(at_shorter, at_longer);
    }
    const double sixteen_areas = 2 * (a * b + b * c + c * a) - (a * a + b * b + c * c);  // squared
    const double most = c / 3;  // of acute faces; what rounding leaves of a sliver's area may be anything
    return std::sqrt(sixteen_areas > 0 ? std::min(a * b * c / sixteen_areas, most) : most);
}

}  // namespace

double vertex_gap(const TriMesh& mesh) {
    double largest = 0;
    for (Eigen::Index f = 0; f < mesh.F.rows(); ++f) {
        const auto edge = [&](int i, int j) {
            return (mesh.X.row(mesh.F(f, i)) - mesh.X.row(mesh.F(f, j))).squaredNorm();
        };
        largest = std::max(largest, gap_of_face({edge(0, 1), edge(1, 2), edge(2, 0)}));
    }
    return largest;
}

}  // namespace nbd
