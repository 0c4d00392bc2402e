#include "meshing/tets/tet_quality.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace nbd {

double radius_ratio(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
                    const Eigen::Vector3d& d) {
    const Eigen::Vector3d u = b - a, v = c - a, w = d - a;
    const double six_volumes = u.cross(v).dot(w);
    const double two_areas =
        u.cross(v).norm() + v.cross(w).norm() + w.cross(u).norm() + (v - u).cross(w - u).norm();
    // inradius = 3 V / area; circumradius = |this vector| / (12 V).
    const double twelve_v_r =
        (u.squaredNorm() * v.cross(w) + v.squaredNorm() * w.cross(u) + w.squaredNorm() * u.cross(v)).norm();
    const double denominator = two_areas * twelve_v_r;
    return denominator > 0 ? 6 * std::abs(six_volumes) * six_volumes / denominator : 0;
}

namespace {

/// In degrees, in [0, 180], for the edges ab ac ad bc bd cd.
std::array<double, 6> dihedral_angles(const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                                      const Eigen::Vector3d& c, const Eigen::Vector3d& d) {
    // Dihedral angle at edge pq between the faces through r and s.
    const auto angle = [](const Eigen::Vector3d& p, const Eigen::Vector3d& q, const Eigen::Vector3d& r,
                          const Eigen::Vector3d& s) {
        const Eigen::Vector3d e = q - p, n = e.cross(r - p), m = e.cross(s - p);
        return std::atan2(n.cross(m).norm(), n.dot(m)) * 180 / std::numbers::pi;
    };
    return {angle(a, b, c, d), angle(a, c, b, d), angle(a, d, b, c),
            angle(b, c, a, d), angle(b, d, a, c), angle(c, d, a, b)};
}

}  // namespace

TetQuality tet_quality(const TetMesh& tets) {
    TetQuality q;
    q.nodes = tets.X.rows();
    q.tets = tets.T.rows();
    if (q.tets == 0) return q;
    q.volume_min = q.radius_ratio_min = q.dihedral_min = std::numeric_limits<double>::infinity();
    for (int t = 0; t < q.tets; ++t) {
        const Eigen::Vector3d a = tets.X.row(tets.T(t, 0)), b = tets.X.row(tets.T(t, 1)),
                              c = tets.X.row(tets.T(t, 2)), d = tets.X.row(tets.T(t, 3));
        const double part = volume(tets, t), ratio = radius_ratio(a, b, c, d);
        q.volume += part;
        q.volume_min = std::min(q.volume_min, part);
        q.radius_ratio_mean += ratio / q.tets;
        if (ratio < q.radius_ratio_min) {
            q.radius_ratio_min = ratio;
            q.worst_tet = t;
        }
        q.poor += ratio < poor_radius_ratio;
        ++q.radius_ratio_histogram[static_cast<std::size_t>(std::clamp(ratio * 10, 0., 9.))];
        const auto angles = dihedral_angles(a, b, c, d);
        const auto [low, high] = std::ranges::minmax(angles);
        q.dihedral_min = std::min(q.dihedral_min, low);
        q.dihedral_max = std::max(q.dihedral_max, high);
    }
    return q;
}

std::string to_text(const TetQuality& q) {
    std::string text = fmt::format("nodes                   {}\n", q.nodes);
    text += fmt::format("tetrahedra              {}\n", q.tets);
    text += fmt::format("volume                  {:.6g} m3, least {:.3g} m3\n", q.volume, q.volume_min);
    text += fmt::format("radius ratio min/mean   {:.3f} / {:.3f}\n", q.radius_ratio_min, q.radius_ratio_mean);
    text += fmt::format("dihedral angles         {:.1f} .. {:.1f} degrees\n", q.dihedral_min, q.dihedral_max);
    text += "radius ratio below      ";
    for (std::size_t k = 1; k <= q.radius_ratio_histogram.size(); ++k)
        text += fmt::format("{:>7.1f}", 0.1 * static_cast<double>(k));
    text += "\n% of tetrahedra         ";
    for (const int count : q.radius_ratio_histogram)
        text += fmt::format("{:>7.2f}", 100.0 * count / std::max(1, q.tets));
    return text + "\n";
}

}  // namespace nbd
