#include "sim/excitation/thickness.hpp"

#include <Eigen/Geometry>
#include <limits>

namespace nbd {

LocalThickness::LocalThickness(const TetMesh& tets) {
    const auto node = [&](int i) { return Eigen::Vector3d(tets.X.row(i)); };
    for (Eigen::Index t = 0; t < tets.T.rows(); ++t) {
        const Eigen::Vector3d a = node(tets.T(t, 0)), b = node(tets.T(t, 1)), c = node(tets.T(t, 2)),
                              d = node(tets.T(t, 3));
        tets_.push_back({(a + b + c + d) / 4, (b - a).cross(c - a).dot(d - a) / 6});
    }
    const Faces faces = boundary_faces(tets);
    for (Eigen::Index f = 0; f < faces.rows(); ++f) {
        const Eigen::Vector3d a = node(faces(f, 0)), b = node(faces(f, 1)), c = node(faces(f, 2));
        faces_.push_back({(a + b + c) / 3, (b - a).cross(c - a).norm() / 2});
    }
}

double LocalThickness::sum(const std::vector<Piece>& pieces, const Eigen::Vector3d& point, double radius) {
    double total = 0;
    for (const Piece& piece : pieces)
        if ((piece.centroid - point).squaredNorm() < radius * radius) total += piece.measure;
    return total;
}

double LocalThickness::at(const Eigen::Vector3d& point, double radius) const {
    const double area = sum(faces_, point, radius);
    return area > 0 ? 4 * volume(point, radius) / area : std::numeric_limits<double>::infinity();
}

double LocalThickness::volume(const Eigen::Vector3d& point, double radius) const {
    return sum(tets_, point, radius);
}

}  // namespace nbd
