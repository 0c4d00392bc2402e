#include "collision/geometry/far_origin.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace nbd {

double float_step(double x) noexcept {
    const float size = std::min(std::abs(static_cast<float>(x)), std::numeric_limits<float>::max() / 2);
    return double{std::nextafter(size, std::numeric_limits<float>::infinity())} - size;
}

double mean_edge(NodesRef X, FacesRef F) {
    double sum = 0, count = 0;
    for (Eigen::Index f = 0; f < F.rows(); ++f) {
        if (F.row(f).minCoeff() < 0 || F.row(f).maxCoeff() >= X.rows()) continue;
        for (int c = 0; c < 3; ++c) sum += (X.row(F(f, c)) - X.row(F(f, (c + 1) % 3))).norm();
        count += 3;
    }
    return count > 0 ? sum / count : 0;
}

Eigen::Vector3d far_origin(const Eigen::AlignedBox3d& box, double edge) {
    constexpr double steps_of_edge = 4000;
    if (box.isEmpty()) return Eigen::Vector3d::Zero();
    const double farthest = std::max(box.min().cwiseAbs().maxCoeff(), box.max().cwiseAbs().maxCoeff());
    if (!(steps_of_edge * float_step(farthest) > edge)) return Eigen::Vector3d::Zero();
    const double size = std::max(box.sizes().maxCoeff(), 1e-12 * farthest);
    const double grid = std::exp2(std::ceil(std::log2(size)));
    return grid * (box.center() / grid).array().round().matrix();
}

Eigen::Vector3d far_origin(NodesRef X, FacesRef F) {
    Eigen::AlignedBox3d box;
    for (Eigen::Index v = 0; v < X.rows(); ++v) box.extend(X.row(v).transpose());
    return far_origin(box, mean_edge(X, F));
}

}  // namespace nbd
