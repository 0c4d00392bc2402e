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

/// Content of the figures and reports on one trained tree.
struct BodyFigures {
    BodyRows rows;                    // all bounds of the tree, at chart_margins()
    std::vector<TestSet> sets;        // the one farthest from training comes last
    TestPose pose;                    // a typical pose of the last set
    std::vector<NodeSphere> spheres;  // in that pose
    Page spheres_page;
};

/// Evaluates a tree and draws its figures. body: its name in pictures. max_frames: per set; 0: all. Throws
/// what test_frames() and evaluate_frames() throw.
BodyFigures make_body_figures(const std::string& body, const TreeFile& tree, const RecordingReader& recording,
                              int max_frames);

/// Coverage of all calibrated bounds of a tree on the last set of its test_frames(), on at most max_frames of
/// them; 0: all.
std::vector<CoverageRow> measure_coverages(const TreeFile& tree, const RecordingReader& recording,
                                           int max_frames);

}  // namespace nbd
