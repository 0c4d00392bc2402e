#pragma once

#include <string>
#include <vector>

#include "apps/drawing/chart.hpp"
#include "training/evaluate/evaluate.hpp"

namespace nbd {

/// Evaluation of one body's tree.
struct BodyRows {
    std::string body;
    std::vector<EvaluationRow> rows;
};

/// The margins of the paper's figure 8: 0 to 25 % in steps of 1 %.
std::vector<double> chart_margins();

/// The paper's figure 6: vertices outside by depth at margin 0. One line per body and learned bound, one
/// panel per set of frames.
Chart outside_by_depth(const std::vector<BodyRows>& bodies);

/// The paper's figure 7: radius error by depth at margin 0. One line per body and bound, without `exact`.
Chart radius_error_by_depth(const std::vector<BodyRows>& bodies);

/// The paper's figure 8: vertices outside by margin. One line per depth, one row of panels per learned bound.
Chart outside_by_margin(const BodyRows& body);

/// CSV of all bodies' rows, with the body as the first column.
std::string to_csv(const std::vector<BodyRows>& bodies);

}  // namespace nbd
