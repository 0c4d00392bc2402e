#pragma once

#include <string>

#include "apps/figures/body_figures.hpp"

namespace nbd {

/// HTML page on one trained tree: verdicts, tables and charts, all in one file. command: the shell
/// command that made it. Throws what draw_chart() throws.
std::string html_report(const TreeFile& tree, const BodyFigures& figures,
                        const std::vector<CoverageRow>& coverage, const std::string& command);

}  // namespace nbd
