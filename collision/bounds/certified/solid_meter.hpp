#pragma once

#include <memory>
#include <span>
#include <vector>

#include "collision/bounds/certified/region_meter.hpp"
#include "collision/geometry/geometry.hpp"
#include "collision/geometry/tet_mesh.hpp"

namespace nbd {

/// Measures the motions of a body's regions from its node positions, for poses without a running simulator,
/// such as recordings. Makes one pass over all tetrahedra per pose.
class SolidMeter {
 public:
    /// Throws std::invalid_argument on a bad tetrahedron or regions that do not fit.
    SolidMeter(const TetMesh& rest, std::shared_ptr<const TetRegions> regions);

    /// nodes: [N, 3], metres. The result stays valid until the next call.
    std::span<const RegionMotion> measure(VerticesRef nodes) noexcept;

 private:
    Eigen::Matrix3d gradient(VerticesRef nodes, int tet) const noexcept;

    Tets T_;
    std::vector<Eigen::Matrix3d> inverse_;  // [T] inverse of the matrix of rest edges from the first corner
    RegionMeter meter_;
};

/// Throws std::invalid_argument naming the first node that is not finite, or the first tetrahedron that
/// refers to a missing node or whose volume is not positive.
void check_solid(const TetMesh& rest);

}  // namespace nbd
