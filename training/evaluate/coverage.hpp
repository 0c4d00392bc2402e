#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "collision/tree/collision_tree.hpp"
#include "training/evaluate/interval.hpp"
#include "training/files/frame_stream.hpp"

namespace nbd {

/// How calibrated bounds did at one depth of the tree, used as queries use them: margins grown with
/// ood_score, exact spheres out of range.
struct CoverageRow {
    BoundKind bound = BoundKind::exact;
    int depth = 0;
    int trajectories = 0;
    long poses = 0;
    double miss_rate = 0, confidence = 0;  // stated
    int keeping = 0;                       // trajectories with a miss rate of at most that
    Interval keeping_share{};              // 95 %, trajectories being independent
    double nodes_missing = 0;       // mean over trajectories of the share of nodes, pose by pose, that miss
    Interval nodes_missing_mean{};  // 95 %, by resampling trajectories
    double vertices_outside = 0;    // share of all
    double inflation = 0;           // mean of r / r_exact - 1
    double out_of_range = 0;        // share of nodes, pose by pose, that were bounded exactly
};

/// Whether a tree's calibrated bounds keep their promise on poses that neither training nor calibration saw.
/// A row a depth. Streams; same bits on any number of threads. Throws std::invalid_argument where the bounds
/// are not calibrated, or no frames.
std::vector<CoverageRow> measure_coverage(const SurfaceBody& body,
                                          const std::shared_ptr<const CollisionTree>& tree, BoundKind kind,
                                          const RecordingReader& recording, std::span<const FrameId> frames);

/// One line a row under a line of column names; shares as plain numbers.
std::string to_csv(const std::vector<CoverageRow>& rows);

/// For reading: a block a bound, a line a depth, in percent.
std::string to_text(const std::vector<CoverageRow>& rows);

}  // namespace nbd
