#include "collision/geometry/bounding_sphere.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace nbd {

Sphere bounding_sphere(VerticesRef x, std::span<const int> vertices) noexcept {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const int v : vertices) sum += x.row(v).transpose().cast<double>();
    const Eigen::Vector3f c = (sum / static_cast<double>(vertices.size())).cast<float>();
    float squared = 0;
    for (const int v : vertices) squared = std::max(squared, (x.row(v).transpose() - c).squaredNorm());
    // Each difference, square and sum rounds by half an ulp: 4 ulp cover them all.
    return {c, std::sqrt(squared) * (1 + 4 * std::numeric_limits<float>::epsilon())};
}

}  // namespace nbd
