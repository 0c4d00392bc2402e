#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "training/evaluate/coverage.hpp"
#include "training/evaluate/evaluate.hpp"

namespace nbd {

/// One bound at one depth on one set of frames: without a margin, and as calibrated.
struct Accuracy {
    EvaluationRow bare;
    std::optional<CoverageRow> calibrated;  // empty if the bound is not calibrated
};

/// Measures bounds of a tree on all of its test_frames(). Skips bounds that the tree does not have. Rows are
/// sorted by set, bound and depth. Throws what test_frames() throws.
std::vector<Accuracy> measure_accuracy(const TreeFile& file, const RecordingReader& recording,
                                       std::span<const BoundKind> bounds);

/// Columns of an Accuracy in a table, and its cells: bound, frames, poses, depth and the measures, as
/// fractions of 1. Cells of a bound that is not calibrated stay empty.
inline constexpr std::string_view accuracy_columns =
    "bound,frames,poses,depth,radius_error,inflation,vertices_outside,nodes_missing,calibrated_inflation,"
    "calibrated_nodes_missing,out_of_range,trajectories_keeping,trajectories";
std::string accuracy_cells(const Accuracy& accuracy);

/// The least and the largest of some numbers.
struct Extent {
    double least = 0, largest = 0;
};

/// One bound on one set of frames: extents over the depths.
struct AccuracyExtents {
    BoundKind bound = BoundKind::exact;
    std::string frames;
    long poses = 0;
    Extent radius_error{}, inflation{};
    bool calibrated = false;  // whether the next two are measured
    Extent calibrated_inflation{}, calibrated_nodes_missing{};
};

/// rows: sorted as by measure_accuracy().
std::vector<AccuracyExtents> over_depths(const std::vector<Accuracy>& rows);

/// Columns of AccuracyExtents in a table, and its cells, as fractions of 1.
inline constexpr std::string_view extents_columns =
    "bound,frames,poses,least_radius_error,largest_radius_error,least_inflation,largest_inflation,"
    "least_calibrated_inflation,largest_calibrated_inflation,largest_calibrated_nodes_missing";
std::string extents_cells(const AccuracyExtents& extents);

/// Lines for people, in percent: one for each set of frames and bound, with the extents over its depths.
std::string to_text(const std::vector<Accuracy>& rows);

/// The same numbers as in accuracy_cells(), as JSON; null for those of a bound that is not calibrated.
nlohmann::ordered_json to_json(const Accuracy& accuracy);

}  // namespace nbd
