#pragma once

#include <memory>
#include <span>
#include <vector>

#include "collision/bounds/certified/region_meter.hpp"
#include "collision/geometry/geometry.hpp"
#include "collision/geometry/tet_mesh.hpp"

namespace nbd {

/// The motions of a body's regions from the positions of its nodes, where no simulator hands them over: for
/// recordings. One walk over all tetrahedra a pose.
class SolidMeter {
 public:
    /// Throws std::invalid_argument on a bad tetrahedron or regions that do not fit.
    SolidMeter(const TetMesh& rest, std::shared_ptr<const TetRegions> regions);

    /// nodes: [N, 3], metres. The result lasts until the next call.
    std::span<const RegionMotion> measure(VerticesRef nodes) noexcept;

 private:
    Eigen::Matrix3d gradient(VerticesRef nodes, int tet) const noexcept;

    Tets T_;
    std::vector<Eigen::Matrix3d> inverse_;  // [T] of the rest edges from the first corner, as columns
    RegionMeter meter_;
};

/// Throws std::invalid_argument naming the first tetrahedron whose index is out of range or whose volume is
/// not positive, or node that is not finite.
void check_solid(const TetMesh& rest);

}  // namespace nbd
