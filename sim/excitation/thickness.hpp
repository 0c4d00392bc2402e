#pragma once

#include <Eigen/Core>
#include <vector>

#include "meshing/surface/mesh.hpp"

namespace nbd {

/// Local thickness of a body: 4 V / A within a ball. It equals the diameter of a rod and twice the thickness
/// of a plate.
class LocalThickness {
 public:
    explicit LocalThickness(const TetMesh& tets);

    /// Thickness around a point, metres; infinite if no surface is near. radius: metres, > 0.
    double at(const Eigen::Vector3d& point, double radius) const;

    /// Volume, m3, of the tetrahedra with centroids in the ball.
    double volume(const Eigen::Vector3d& point, double radius) const;

 private:
    struct Piece {
        Eigen::Vector3d centroid;
        double measure;  // volume or area
    };
    static double sum(const std::vector<Piece>& pieces, const Eigen::Vector3d& point, double radius);

    std::vector<Piece> tets_, faces_;
};

}  // namespace nbd
