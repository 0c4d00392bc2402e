#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "collision/tree/collision_tree.hpp"
#include "training/evaluate/interval.hpp"
#include "training/files/frame_stream.hpp"

namespace nbd {

struct ContactScenesConfig {
    int scenes = 300;
    double deepest = 0.1;  // most by which a scene's bodies overlap, in radii of the body at rest, > 0
    std::uint64_t seed = 1;
};

/// What a bound's misses cost in the end: face pairs that intersect and are not found.
struct ContactScenesRow {
    BoundKind bound = BoundKind::exact;
    int scenes = 0;                   // in which the bodies intersect
    int scenes_missing = 0;           // of them, where a pair was not found
    long face_pairs = 0, missed = 0;  // pairs that intersect, and of them those not found
    Interval missed_share{};          // 95 %, by resampling scenes
    double nodes_bounded = 0;         // mean a scene
    double leaf_pairs = 0;            // mean a scene, that boxes and triangles are tested for
    double exact_leaf_pairs = 0;      // as many as `exact` leaves
    double out_of_range = 0;          // mean a scene: nodes bounded exactly
};

/// Scenes of two copies of the body: each takes two of the frames at random, of different trajectories where
/// there are some, turns the second one at random, brings it towards the first from a random side until they
/// touch, and then some deeper. Every bound of `kinds` that the tree has is compared with `exact` on the same
/// scenes; margins are the calibrated ones. Throws std::invalid_argument on a config out of range or no
/// frames.
std::vector<ContactScenesRow> check_contact_scenes(const SurfaceBody& body,
                                                   const std::shared_ptr<const CollisionTree>& tree,
                                                   std::span<const BoundKind> kinds,
                                                   const RecordingReader& recording,
                                                   std::span<const FrameId> frames,
                                                   const ContactScenesConfig& config = {});

/// One line a row under a line of column names.
std::string to_csv(const std::vector<ContactScenesRow>& rows);

/// For reading: a line a bound.
std::string to_text(const std::vector<ContactScenesRow>& rows);

}  // namespace nbd
