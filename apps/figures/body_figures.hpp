#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "training/evaluate/coverage.hpp"
#include "training/evaluate/evaluate.hpp"

namespace nbd {

/// Evaluation of one body's tree.
struct BodyRows {
    std::string body;
    std::vector<EvaluationRow> rows;
};

/// CSV of all bodies' rows, with the body as the first column.
std::string to_csv(const std::vector<BodyRows>& bodies);

/// A set of frames that a tree was tested on.
struct TestSet {
    std::string name;
    int frames = 0, trajectories = 0;
};

/// Content of the figures and reports on one trained tree.
struct BodyFigures {
    BodyRows rows;  // its bounds, at margins of 0 to 25 % in steps of 1 %, as in the paper's figure 8
    std::vector<TestSet> sets;  // the one farthest from training comes last
};

/// Evaluates a tree. body: its name in pictures. max_frames: per set; 0: all. Throws what test_frames() and
/// evaluate_frames() throw.
BodyFigures make_body_figures(const std::string& body, const TreeFile& tree, const RecordingReader& recording,
                              int max_frames);

/// Coverage of all calibrated bounds of a tree on the last set of its test_frames(), on at most max_frames of
/// them; 0: all.
std::vector<CoverageRow> measure_coverages(const TreeFile& tree, const RecordingReader& recording,
                                           int max_frames);

/// The table and charts of one or several bodies, as files in a folder: bounds.csv, figure6.png, figure7.png,
/// figure8_BODY.png. Throws what draw_chart() throws.
void write_table_and_charts(const std::filesystem::path& folder, const std::vector<BodyRows>& bodies);

}  // namespace nbd
