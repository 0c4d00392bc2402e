#pragma once

#include <iterator>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "collision/tree/collision_tree.hpp"
#include "training/files/frame_stream.hpp"

namespace nbd {

struct EvaluateConfig {
    std::vector<BoundKind> bounds{BoundKind::exact, BoundKind::bd, BoundKind::nbd, BoundKind::learned_spheres,
                                  BoundKind::certified};
    std::vector<double> margins{0, 0.01, 0.02, 0.05, 0.10};  // added to every radius, relative; >= 0
    int max_frames = 0;                                      // of each set, evenly spread; 0: all
};

/// How one bound did at one depth of the tree with one margin, over all frames of a set. Exact spheres are
/// those of bounding_sphere() in the pose.
struct EvaluationRow {
    std::string frames;  // "random frames", "held-out trajectories" or "other recording"
    BoundKind bound = BoundKind::exact;
    int depth = 0;                // of the nodes
    double margin = 0;            // relative
    double radius_error = 0;      // mean of |r - r_exact| / r_exact, margin included
    double inflation = 0;         // mean of r / r_exact - 1, likewise: what a bound costs that is only larger
    double centre_error = 0;      // mean of |c - c_exact| / r_exact
    double vertices_outside = 0;  // share of vertices outside, each counted in every node that lists it
    double nodes_missing = 0;     // share of nodes that leave any of their vertices outside
    long poses = 0, nodes = 0, vertices = 0;  // what the means and shares are over: frames, nodes, vertices
                                              // times frames
};

/// Evaluates a tree on a list of frames, named `name` in the rows. Streams; same bits on any number of
/// threads. Bounds that the tree does not have are left out. Rows by bound, margin and depth.
/// Throws std::invalid_argument on a margin out of range, no frames, or a tree of another surface.
std::vector<EvaluationRow> evaluate_frames(const SurfaceBody& body,
                                           const std::shared_ptr<const CollisionTree>& tree,
                                           const RecordingReader& recording, std::span<const FrameId> frames,
                                           const std::string& name, const EvaluateConfig& config = {});

/// Frames that a tree's training did not see, under the name that rows give them.
struct TestFrames {
    std::string name;
    std::vector<FrameId> frames;
};

/// What training did not see: of the recording that the tree was trained on, the random test frames and the
/// held-out trajectories, also where `nbdtree carry` brought them, or some of them, to another surface; of
/// any other recording of the body, all of it. Empty sets are left out. Reads the recording once. Throws
/// std::runtime_error where tree and recording are not of one body or nothing is left to test on.
std::vector<TestFrames> test_frames(const TreeFile& tree, const RecordingReader& recording);

/// Evaluates a trained tree on all of its test_frames(), set by set. Throws what test_frames() and
/// evaluate_frames() throw.
std::vector<EvaluationRow> evaluate(const TreeFile& tree, const RecordingReader& recording,
                                    const EvaluateConfig& config = {});

/// One line a row under a line of column names; shares and errors as plain numbers.
std::string to_csv(const std::vector<EvaluationRow>& rows);

/// For reading: a block per set and bound, a line a depth, errors and shares in percent; the radius error is
/// that at the first margin.
std::string to_text(const std::vector<EvaluationRow>& rows);

}  // namespace nbd
