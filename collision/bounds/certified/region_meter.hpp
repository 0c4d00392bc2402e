#pragma once

#include <memory>
#include <span>
#include <vector>

#include "collision/bounds/certified/region_motion.hpp"
#include "collision/geometry/geometry.hpp"
#include "collision/geometry/tet_mesh.hpp"

namespace nbd {

/// Measures the motions of a body's regions during a pass over its tetrahedra: call reset() with the
/// gradients of the samples, then add() for every tetrahedron, in any order and from any threads; the result
/// has the same bits. A simulator that computes the gradients anyway calls both; other programs use
/// SolidMeter.
class RegionMeter {
 public:
    static constexpr int lanes = 8;
    using Lanes = Eigen::Array<double, lanes, 1>;
    using LaneMatrix = std::array<Lanes, 9>;  // entries column by column, one tetrahedron per lane

    /// Throws std::invalid_argument unless the regions fit `tet_count` tetrahedra.
    RegionMeter(std::shared_ptr<const TetRegions> regions, int tet_count);

    /// gradient(t): the deformation gradient of tetrahedron t in this pose, a 3x3 matrix of double.
    template <class Gradient>
    void reset(const Gradient& gradient) noexcept {
        for (int r = 0; r < regions_->count(); ++r) {
            Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
            const std::span<const int> samples = samples_of(r);
            for (const int t : samples) sum += gradient(t);
            start(r, sum / static_cast<double>(samples.size()));
        }
    }

    /// F: gradients of tetrahedra first to first + count - 1; the other lanes are ignored.
    void add(int first, int count, const LaneMatrix& F) noexcept;

    /// One per region: bounds on all gradients added since reset(). Infinite if a gradient is not finite.
    std::span<const RegionMotion> motions() const noexcept { return motions_; }

 private:
    std::span<const int> samples_of(int region) const noexcept;
    void start(int region, const Eigen::Matrix3d& G) noexcept;

    std::shared_ptr<const TetRegions> regions_;
    std::vector<RegionMotion> motions_;  // [regions]
};

/// Throws std::invalid_argument unless every tetrahedron has a region, every region has samples, and all
/// indices are in range.
void check_tet_regions(const TetRegions& regions, int tet_count);

}  // namespace nbd
