#pragma once

#include <string>
#include <vector>

#include "apps/drawing/chart.hpp"
#include "training/evaluate/evaluate.hpp"

namespace nbd {

/// What an evaluation said of the tree of one body.
struct BodyRows {
    std::string body;
    std::vector<EvaluationRow> rows;
};

/// The margins of the paper's figure 8: 0 to 25 % in steps of 1 %.
std::vector<double> chart_margins();

/// The paper's figure 6: vertices outside by depth at margin 0, a line a body and learned bound, a panel a
/// set of frames.
Chart outside_by_depth(const std::vector<BodyRows>& bodies);

/// The paper's figure 7: radius error by depth at margin 0, a line a body and bound but `exact`.
Chart radius_error_by_depth(const std::vector<BodyRows>& bodies);

/// The paper's figure 8: vertices outside against the margin, a line a depth, a row of panels a learned
/// bound.
Chart outside_by_margin(const BodyRows& body);

/// The rows of all bodies, as to_csv() has them, the body in front.
std::string to_csv(const std::vector<BodyRows>& bodies);

}  // namespace nbd
