#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "collision/tree/collision_tree.hpp"
#include "training/calibrate/statistics.hpp"
#include "training/files/frame_source.hpp"
#include "training/files/surface_body.hpp"

namespace nbd {

/// Measured coverage of calibrated bounds at one depth of the tree, used as in queries: margins that grow
/// with ood_score, exact spheres out of range.
struct CoverageRow {
    BoundKind bound = BoundKind::exact;
    int depth = 0;
    int trajectories = 0;
    long poses = 0;
    double miss_rate = 0, confidence = 0;  // stated
    int keeping = 0;                       // trajectories with at most the stated miss rate
    Interval keeping_share{};              // 95 %, assuming independent trajectories
    double nodes_missing = 0;              // share of (pose, node) pairs that miss, mean over trajectories
    Interval nodes_missing_mean{};         // 95 %, by resampling trajectories
    double vertices_outside = 0;           // share of all vertices
    double inflation = 0;                  // mean of r / r_exact - 1
    double out_of_range = 0;               // share of (pose, node) pairs bounded exactly
};

/// The kinds of bounds that the tree has a calibration for, in order. Throws std::invalid_argument if there
/// are none.
std::vector<BoundKind> calibrated_bounds(const CollisionTree& tree);

/// Throws std::invalid_argument, naming it, for a kind of bounds that the tree does not have.
void check_has_bounds(const CollisionTree& tree, std::span<const BoundKind> kinds);

/// Measures whether a tree's calibrated bounds keep the stated miss rate on poses that neither training nor
/// calibration saw. One row per depth; `learned_affine` has three, for boxes of clusters, blocks and leaves,
/// whose nodes are LearnedAffineModel::bounds(). Streams; same bits on any number of threads. Throws
/// std::invalid_argument if the bounds are not calibrated or there are no frames.
std::vector<CoverageRow> measure_coverage(const SurfaceBody& body,
                                          const std::shared_ptr<const CollisionTree>& tree, BoundKind kind,
                                          const RecordingReader& recording, std::span<const FrameId> frames);

/// CSV: column names, then one line per row; shares as fractions of 1.
std::string to_csv(const std::vector<CoverageRow>& rows);

/// Text tables, one per bound, one line per depth, in percent.
std::string to_text(const std::vector<CoverageRow>& rows);

}  // namespace nbd
