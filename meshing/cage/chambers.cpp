#include "meshing/cage/chambers.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace nbd {
namespace {

std::size_t index(int side, int i, int j, int k) { return (i * side + j) * side + k; }

}  // namespace

ChamberGrid::ChamberGrid(const Eigen::AlignedBox3d& box)
    : corner_(box.min()), step_((box.sizes() / side).cwiseMax(1e-9 * box.diagonal().norm())) {
    // Uneven shifts keep the columns off the edges of axis-aligned shapes.
    corner_ += step_.cwiseProduct(Eigen::Vector3d(0.5123, 0.4871, 0.5));
}

Eigen::Vector3d ChamberGrid::point(int i, int j, int k) const {
    return corner_ + step_.cwiseProduct(Eigen::Vector3d(i, j, k));
}

/// Counts the crossings of each column of points with the surface.
std::vector<char> ChamberGrid::inside(const TriMesh& surface) const {
    std::vector<std::vector<double>> heights(static_cast<std::size_t>(side) * side);
    for (int f = 0; f < surface.F.rows(); ++f) {
        Eigen::Matrix3d corners;  // columns; in steps from the grid's corner
        for (int c = 0; c < 3; ++c)
            corners.col(c) = (surface.X.row(surface.F(f, c)).transpose() - corner_).cwiseQuotient(step_);
        const Eigen::Vector3d a = corners.col(0), b = corners.col(1), c = corners.col(2);
        const Eigen::Vector3d low = corners.rowwise().minCoeff(), high = corners.rowwise().maxCoeff();
        const double doubled = (b - a).x() * (c - a).y() - (b - a).y() * (c - a).x();
        if (doubled == 0) continue;
        const auto first = [](double x) { return std::max(0, static_cast<int>(std::ceil(x))); };
        const auto last = [](double x) { return std::min(side - 1, static_cast<int>(std::floor(x))); };
        for (int i = first(low.x()); i <= last(high.x()); ++i)
            for (int j = first(low.y()); j <= last(high.y()); ++j) {
                const auto side_of = [&](const Eigen::Vector3d& p, const Eigen::Vector3d& q) {
                    return ((q.x() - p.x()) * (j - p.y()) - (q.y() - p.y()) * (i - p.x())) / doubled;
                };
                const double wa = side_of(b, c), wb = side_of(c, a), wc = side_of(a, b);
                if (wa < 0 || wb < 0 || wc < 0) continue;
                heights[i * side + j].push_back(wa * a.z() + wb * b.z() + wc * c.z());
            }
    }
    std::vector<char> result(static_cast<std::size_t>(side) * side * side, 0);
    for (int i = 0; i < side; ++i)
        for (int j = 0; j < side; ++j) {
            std::vector<double>& column = heights[i * side + j];
            std::ranges::sort(column);
            std::size_t below = 0;
            for (int k = 0; k < side; ++k) {
                while (below < column.size() && column[below] < k) ++below;
                result[index(side, i, j, k)] = below % 2 == 1;
            }
        }
    return result;
}

double ChamberGrid::share_lost(const TriMesh& coarse, const TriMesh& fine, const SoupWrap& soup,
                               double depth) const {
    const std::vector<char> before = inside(coarse), after = inside(fine);
    double all = 0, chambers = 0, lost = 0;
    for (int i = 0; i < side; ++i)
        for (int j = 0; j < side; ++j)
            for (int k = 0; k < side; ++k) {
                const std::size_t p = index(side, i, j, k);
                if (!before[p]) continue;
                ++all;
                if (!(soup.distance(point(i, j, k)) > depth)) continue;
                ++chambers;
                lost += !after[p];
            }
    return chambers >= all / 20 && chambers > 0 ? lost / chambers : 0;
}

}  // namespace nbd
