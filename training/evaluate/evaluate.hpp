#pragma once

#include <iterator>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "collision/tree/collision_tree.hpp"
#include "training/files/frame_source.hpp"
#include "training/files/surface_body.hpp"

namespace nbd {

struct EvaluateConfig {
    std::vector<BoundKind> bounds{BoundKind::exact, BoundKind::bd, BoundKind::nbd, BoundKind::learned_affine};
    std::vector<double> margins{0, 0.01, 0.02, 0.05, 0.10};  // added to every radius, relative; >= 0
    int max_frames = 0;                                      // maximum frames per set, evenly spread; 0: all
};

/// Result of one bound at one depth of the tree with one margin, over all frames of a set. Exact spheres are
/// those of bounding_sphere() in the pose. The nodes of `learned_affine` are those of the wide tree:
/// clusters, blocks and leaves; the centre and radius of a box are its middle and half its diagonal, and a
/// margin scales it about its centre.
struct EvaluationRow {
    std::string frames;  // "random frames", "held-out trajectories" or "other recording"
    BoundKind bound = BoundKind::exact;
    int depth = 0;                // of the nodes
    double margin = 0;            // relative
    double radius_error = 0;      // mean of |r - r_exact| / r_exact, margin included
    double inflation = 0;         // mean of r / r_exact - 1, margin included: the cost of a larger bound
    double centre_error = 0;      // mean of |c - c_exact| / r_exact
    double vertices_outside = 0;  // share of vertices outside, counted in every node that lists them
    double nodes_missing = 0;     // share of nodes with any vertex outside
    long poses = 0, nodes = 0, vertices = 0;  // counts over all poses behind the means and shares
};

/// Evaluates a tree on a list of frames; `name` goes to EvaluationRow::frames. Streams; same bits on any
/// number of threads. Skips bounds that the tree does not have. Rows are sorted by bound, margin and depth.
/// Throws std::invalid_argument on a margin out of range, no frames, or a tree of another surface.
std::vector<EvaluationRow> evaluate_frames(const SurfaceBody& body,
                                           const std::shared_ptr<const CollisionTree>& tree,
                                           const RecordingReader& recording, std::span<const FrameId> frames,
                                           const std::string& name, const EvaluateConfig& config = {});

/// Named set of frames that a tree's training did not see.
struct TestFrames {
    std::string name;
    std::vector<FrameId> frames;
};

/// Frames that training did not see. Of the recording that the tree was trained on: random test frames and
/// held-out trajectories, also after `nbdtree remap` moved some or all of them to another surface. Of another
/// recording of the body: all complete frames. Trajectories that the tree was trained or calibrated on, in
/// whatever file, are left out, which a notice tells, or that it cannot be checked. Skips empty sets. Reads
/// the recording once. Throws std::runtime_error if tree and recording belong to different bodies or nothing
/// is left to test on.
std::vector<TestFrames> test_frames(const TreeFile& tree, const RecordingReader& recording);

/// Evaluates a trained tree on all of its test_frames(), set by set. Throws what test_frames() and
/// evaluate_frames() throw, and std::invalid_argument if the tree has none of the bounds, and for
/// `affine`.
std::vector<EvaluationRow> evaluate(const TreeFile& tree, const RecordingReader& recording,
                                    const EvaluateConfig& config = {});

/// CSV: column names, then one line per row; shares and errors as fractions of 1.
std::string to_csv(const std::vector<EvaluationRow>& rows);

/// Text tables, one per set and bound, in percent; errors are those at the first margin. One line each for
/// the root, the middle and the leaves.
std::string to_text(const std::vector<EvaluationRow>& rows);

}  // namespace nbd
