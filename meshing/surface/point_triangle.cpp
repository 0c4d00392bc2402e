#include "meshing/surface/point_triangle.hpp"

#include <Eigen/Geometry>
#include <algorithm>

namespace nbd {
namespace {

double squared_distance_to_segment(const Eigen::Vector3d& p, const Eigen::Vector3d& a,
                                   const Eigen::Vector3d& b) {
    const Eigen::Vector3d ab = b - a;
    const double length = ab.squaredNorm();
    const double s = length > 0 ? std::clamp((p - a).dot(ab) / length, 0., 1.) : 0;
    return (a + s * ab - p).squaredNorm();
}

}  // namespace

double squared_distance_to_triangle(const Eigen::Vector3d& p, const Eigen::Vector3d& a,
                                    const Eigen::Vector3d& b, const Eigen::Vector3d& c) noexcept {
    const Eigen::Vector3d n = (b - a).cross(c - a);
    const auto inside = [&](const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
        return n.cross(to - from).dot(p - from) >= 0;
    };
    if (n.squaredNorm() > 0 && inside(a, b) && inside(b, c) && inside(c, a)) {
        const double height = n.dot(p - a);
        return height * height / n.squaredNorm();
    }
    return std::min({squared_distance_to_segment(p, a, b), squared_distance_to_segment(p, b, c),
                     squared_distance_to_segment(p, c, a)});
}

}  // namespace nbd
