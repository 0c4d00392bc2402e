#pragma once

#include <limits>

#include "collision/continuous/feature_pair.hpp"

namespace nbd {

/// The boxes of both features of a pair, in double precision.
class PairBoxes {
 public:
    explicit PairBoxes(FeatureKind kind) : of_a_(corners_of_a(kind)) {}

    /// corner: 0 .. 3, in the order of closest_points().
    void add(std::size_t corner, const Eigen::Array3d& p) {
        Box& box = corner < of_a_ ? a_ : b_;
        box.low = box.low.min(p);
        box.high = box.high.max(p);
    }

    /// The gap between the boxes along each axis; negative where they overlap.
    Eigen::Array3d gaps() const { return (a_.low - b_.high).max(b_.low - a_.high); }

 private:
    struct Box {
        Eigen::Array3d low = Eigen::Array3d::Constant(std::numeric_limits<double>::infinity()), high = -low;
    };
    std::size_t of_a_;
    Box a_, b_;
};

}  // namespace nbd
