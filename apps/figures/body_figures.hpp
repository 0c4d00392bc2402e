#pragma once

#include <string>
#include <vector>

#include "apps/figures/accuracy_charts.hpp"
#include "apps/figures/sphere_pictures.hpp"
#include "apps/figures/test_pose.hpp"
#include "training/evaluate/coverage.hpp"

namespace nbd {

/// A set of frames that a tree was tested on.
struct TestSet {
    std::string name;
    int frames = 0, trajectories = 0;
};

/// All that figures and reports show of one trained tree.
struct BodyFigures {
    BodyRows rows;                    // all bounds of the tree, at chart_margins()
    std::vector<TestSet> sets;        // the one farthest from training comes last
    TestPose pose;                    // a typical one of the last set
    std::vector<NodeSphere> spheres;  // in that pose
    Page spheres_page;
};

/// Evaluates and draws. body: what pictures call it. max_frames: of each set; 0: all. Throws what
/// test_frames() and evaluate_frames() throw.
BodyFigures make_body_figures(const std::string& body, const TreeFile& tree, const RecordingReader& recording,
                              int max_frames);

/// How all calibrated bounds of a tree did on the last of its test_frames(), at most so many of them.
std::vector<CoverageRow> measure_coverages(const TreeFile& tree, const RecordingReader& recording,
                                           int max_frames);

}  // namespace nbd
