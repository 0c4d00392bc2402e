#pragma once

#include <memory>
#include <span>

#include "collision/base/counter_random.hpp"
#include "collision/query/pair_query.hpp"
#include "training/files/recording.hpp"
#include "training/files/split.hpp"

namespace nbd {

/// How two poses of a body come to meet: the frames they are in, the turn of the second one about its centre,
/// and the side that it comes from.
struct ContactPlacement {
    FrameId first, second;
    Eigen::Matrix3f turn = Eigen::Matrix3f::Identity();
    Eigen::RowVector3f from = Eigen::RowVector3f::UnitX();
};

/// Two frames at random, of different trajectories where there are some, a turn and a side. frames:
/// ascending, not empty.
ContactPlacement draw_contact_placement(std::span<const FrameId> frames, CounterRandom& random);

/// Brings one surface towards another. Both are surfaces of the tree given, about their own centres.
class Approach {
 public:
    explicit Approach(const std::shared_ptr<const CollisionTree>& tree);

    /// a: the first surface. b: the second one, turned already. from: unit vector. All are copied.
    void start(const Vertices& a, const Vertices& b, const Eigen::RowVector3f& from);

    /// Face pairs that intersect when the second surface stands at distance * from, sorted. Valid until the
    /// next call.
    std::span<const FacePair> pairs_at(float distance);

    /// A distance at which they intersect, found by halving the range between 0 and where they cannot: within
    /// 1/4096 of that range, less distance than where they just part.
    float touching_distance();

    /// The second surface where pairs_at() left it.
    const Vertices& second() const noexcept { return placed_; }

 private:
    PosedTree a_, b_;
    PairQuery query_;
    Vertices first_, turned_, placed_;
    Eigen::RowVector3f from_ = Eigen::RowVector3f::UnitX();
};

}  // namespace nbd
