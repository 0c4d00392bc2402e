#include "collision/bounds/certified/solid_meter.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <stdexcept>

#include "collision/base/message.hpp"

namespace nbd {
namespace {

/// Edges from the first corner, as columns.
template <class Positions>
Eigen::Matrix3d edges(const Positions& x, const Tets& T, int t) noexcept {
    const Eigen::RowVector3d origin = x.row(T(t, 0)).template cast<double>();
    Eigen::Matrix3d D;
    for (int a = 0; a < 3; ++a) D.col(a) = (x.row(T(t, a + 1)).template cast<double>() - origin).transpose();
    return D;
}

}  // namespace

SolidMeter::SolidMeter(const TetMesh& rest, std::shared_ptr<const TetRegions> regions)
    : T_(rest.T), meter_(std::move(regions), static_cast<int>(rest.T.rows())) {
    check_solid(rest);
    for (int t = 0; t < T_.rows(); ++t) inverse_.push_back(edges(rest.X, T_, t).inverse());
}

Eigen::Matrix3d SolidMeter::gradient(VerticesRef nodes, int tet) const noexcept {
    return edges(nodes, T_, tet) * inverse_[static_cast<std::size_t>(tet)];
}

std::span<const RegionMotion> SolidMeter::measure(VerticesRef nodes) noexcept {
    meter_.reset([&](int t) { return gradient(nodes, t); });
    const int tets = static_cast<int>(T_.rows());
    RegionMeter::LaneMatrix lanes;
    for (auto& entry : lanes) entry.setZero();
    for (int first = 0; first < tets; first += RegionMeter::lanes) {
        const int count = std::min(RegionMeter::lanes, tets - first);
        for (int l = 0; l < count; ++l) {
            const Eigen::Matrix3d F = gradient(nodes, first + l);
            for (std::size_t k = 0; k < 9; ++k) lanes[k][l] = F.data()[k];
        }
        meter_.add(first, count, lanes);
    }
    return meter_.motions();
}

void check_solid(const TetMesh& rest) {
    for (Eigen::Index i = 0; i < rest.X.rows(); ++i)
        if (!rest.X.row(i).allFinite())
            throw std::invalid_argument(message("solid: node ", i, " is not finite"));
    for (int t = 0; t < rest.T.rows(); ++t) {
        for (const int node : rest.T.row(t))
            if (node < 0 || node >= rest.X.rows())
                throw std::invalid_argument(message("solid: tetrahedron ", t, " refers to node ", node,
                                                    ", but the node count is ", rest.X.rows()));
        if (const double det = edges(rest.X, rest.T, t).determinant(); !(det > 0))
            throw std::invalid_argument(
                message("solid: tetrahedron ", t, " must have a volume above 0, but has ", det / 6));
    }
}

}  // namespace nbd
