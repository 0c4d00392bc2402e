#pragma once

#include <array>
#include <string>

#include "meshing/surface/mesh.hpp"

namespace nbd {

/// Shape figures of a tetrahedral mesh. Radius ratio: 3 x inradius / circumradius, 1 for the regular
/// tetrahedron, 0 for a flat one, negative for an inverted one. Angles: dihedral, degrees.
struct TetQuality {
    int nodes = 0, tets = 0;
    double volume = 0, volume_min = 0;  // m3, signed
    double radius_ratio_min = 0, radius_ratio_mean = 0;
    double dihedral_min = 0, dihedral_max = 0;
    int worst_tet = -1;  // the one of radius_ratio_min
    std::array<int, 10>
        radius_ratio_histogram{};  // tets with a ratio in [k/10, (k+1)/10); below 0 counts in 0
};

/// Of all tetrahedra; zeros where there are none.
TetQuality tet_quality(const TetMesh& tets);

/// Signed radius ratio of one tetrahedron.
double radius_ratio(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
                    const Eigen::Vector3d& d);

/// The six dihedral angles in degrees, in [0, 180], for the edges ab ac ad bc bd cd.
std::array<double, 6> dihedral_angles(const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                                      const Eigen::Vector3d& c, const Eigen::Vector3d& d);

/// The figures as a small table of text lines, each ended by a newline.
std::string to_text(const TetQuality& quality);

}  // namespace nbd
