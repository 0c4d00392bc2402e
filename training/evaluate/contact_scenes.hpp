#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "collision/tree/collision_tree.hpp"
#include "training/calibrate/conformal.hpp"
#include "training/files/frame_source.hpp"
#include "training/files/surface_body.hpp"

namespace nbd {

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
