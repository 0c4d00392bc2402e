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

/// Lines for people, in percent: one for each set of frames and bound, with the extents over its depths.
/// Each begins with `indent`.
std::string to_text(const std::vector<Accuracy>& rows, std::string_view indent);

/// The same numbers as in accuracy_cells(), as JSON; null for those of a bound that is not calibrated.
nlohmann::ordered_json to_json(const Accuracy& accuracy);

}  // namespace nbd
