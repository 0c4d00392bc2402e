#pragma once

#include <string>
#include <vector>

#include "training/evaluate/coverage.hpp"
#include "training/evaluate/evaluate.hpp"

namespace nbd {

/// One plain sentence per bound except `exact`: how often it misses, which margin leaves at most one miss per
/// thousand nodes at every depth, and the cost of that margin. Judged on the last set of the rows. rows: from
/// evaluate_frames(), not empty, with ascending margins from 0.
std::vector<std::string> verdicts(const std::vector<EvaluationRow>& rows);

/// Verdict on each calibrated bound, used as in queries. coverage: from measure_coverage(), the rows of a
/// bound adjacent.
std::vector<std::string> verdicts(const std::vector<CoverageRow>& coverage);

}  // namespace nbd
