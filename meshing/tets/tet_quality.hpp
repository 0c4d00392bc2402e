#pragma once

#include <array>
#include <string>

#include "meshing/surface/mesh.hpp"

namespace nbd {

/// Tetrahedra of a lower radius ratio are poor: steps of a simulation are stiff there.
constexpr double poor_radius_ratio = 0.1;

/// Shape measures of a tetrahedral mesh. Radius ratio: 3 x inradius / circumradius; 1 for the regular
/// tetrahedron, 0 for a flat one, negative for an inverted one. Angles are dihedral, in degrees.
struct TetQuality {
    int nodes = 0, tets = 0;
    double volume = 0, volume_min = 0;  // m3, signed
    double radius_ratio_min = 0, radius_ratio_mean = 0;
    double dihedral_min = 0, dihedral_max = 0;
    int worst_tet = -1;  // tetrahedron with radius_ratio_min
    int poor = 0;        // tetrahedra below poor_radius_ratio
    std::array<int, 10>
        radius_ratio_histogram{};  // tets with a ratio in [k/10, (k+1)/10); bin 0 includes ratios below 0
};

/// Measures all tetrahedra; all zeros if there are none.
TetQuality tet_quality(const TetMesh& tets);

/// Signed radius ratio of one tetrahedron.
double radius_ratio(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
                    const Eigen::Vector3d& d);

/// The measures as a small text table; every line ends in a newline.
std::string to_text(const TetQuality& quality);

}  // namespace nbd
