#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "collision/base/counter_random.hpp"
#include "collision/query/pair_query.hpp"
#include "training/calibrate/statistics.hpp"
#include "training/files/frame_source.hpp"
#include "training/files/surface_body.hpp"

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

struct ContactScenesConfig {
    int scenes = 300;
    double deepest = 0.1;  // maximum overlap of the bodies, in radii of the body at rest, in (0, 1]
    std::uint64_t seed = 1;
};

/// End-to-end effect of a bound's misses: intersecting face pairs that are not found.
struct ContactScenesRow {
    BoundKind bound = BoundKind::exact;
    int scenes = 0;                   // scenes in which the bodies intersect
    int scenes_missing = 0;           // scenes in which a pair was not found
    long face_pairs = 0, missed = 0;  // intersecting pairs, and those not found
    Interval missed_share{};          // 95 %, by resampling scenes
    double nodes_bounded = 0;         // mean per scene
    double leaf_pairs = 0;            // mean per scene; each is tested by boxes and triangles
    double exact_leaf_pairs = 0;      // mean per scene with `exact` bounds
    double out_of_range = 0;          // mean per scene: nodes bounded exactly
};

/// Compares every bound of `kinds` that the tree has with `exact` on the same contact scenes. A scene has two
/// copies of the body in random frames, of different trajectories if there are several. The second copy is
/// rotated at random, moved towards the first from a random side until they touch, and then a random depth
/// further. Margins are the calibrated ones. Throws std::invalid_argument on a config out of range or no
/// frames.
std::vector<ContactScenesRow> check_contact_scenes(const SurfaceBody& body,
                                                   const std::shared_ptr<const CollisionTree>& tree,
                                                   std::span<const BoundKind> kinds,
                                                   const RecordingReader& recording,
                                                   std::span<const FrameId> frames,
                                                   const ContactScenesConfig& config = {});

/// CSV: column names, then one line per row.
std::string to_csv(const std::vector<ContactScenesRow>& rows);

/// Text table, one line per bound.
std::string to_text(const std::vector<ContactScenesRow>& rows);

}  // namespace nbd
