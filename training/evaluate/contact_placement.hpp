#pragma once

#include <memory>
#include <span>

#include "collision/base/counter_random.hpp"
#include "collision/query/pair_query.hpp"
#include "training/files/recording.hpp"
#include "training/files/split.hpp"

namespace nbd {

/// Placement of two poses of a body for a contact: their frames, the rotation of the second one about its
/// centre, and the side from which it approaches.
struct ContactPlacement {
    FrameId first, second;
    Eigen::Matrix3f turn = Eigen::Matrix3f::Identity();
    Eigen::RowVector3f from = Eigen::RowVector3f::UnitX();
};

/// Draws two frames, of different trajectories if there are several, a rotation and a side. frames:
/// ascending, not empty.
ContactPlacement draw_contact_placement(std::span<const FrameId> frames, CounterRandom& random);

/// Moves one surface towards another. Both are surfaces of the given tree, relative to their own centres.
class Approach {
 public:
    explicit Approach(const std::shared_ptr<const CollisionTree>& tree);

    /// a: the first surface. b: the second one, already rotated. from: unit vector. All are copied.
    void start(const Vertices& a, const Vertices& b, const Eigen::RowVector3f& from);

    /// Face pairs that intersect when the second surface is moved by distance * from, sorted. Valid until the
    /// next call.
    std::span<const FacePair> pairs_at(float distance);

    /// A distance at which the surfaces intersect, at most 1/4096 of the search range below the distance
    /// where they separate. The search bisects between 0 and a distance at which they cannot touch.
    float touching_distance();

    /// The second surface as last moved by pairs_at().
    const Vertices& second() const noexcept { return placed_; }

 private:
    PosedTree a_, b_;
    PairQuery query_;
    Vertices first_, turned_, placed_;
    Eigen::RowVector3f from_ = Eigen::RowVector3f::UnitX();
};

}  // namespace nbd
