#pragma once

#include <string>
#include <vector>

#include "training/evaluate/coverage.hpp"
#include "training/evaluate/evaluate.hpp"

namespace nbd {

/// What each bound may be trusted with, in a plain sentence: how often it misses, at which margin it would
/// miss at most one node in a thousand at every depth, what that costs. Judged on the last set of the rows.
/// rows: of evaluate_frames(), with ascending margins from 0, not empty.
std::vector<std::string> verdicts(const std::vector<EvaluationRow>& rows);

/// What each calibrated bound, used as queries use it, may be trusted with, likewise. promises: of
/// measure_coverage(), a bound's rows side by side.
std::vector<std::string> verdicts(const std::vector<CoverageRow>& coverage);

}  // namespace nbd
