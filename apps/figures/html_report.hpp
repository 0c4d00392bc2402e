#pragma once

#include <string>

#include "apps/figures/body_figures.hpp"

namespace nbd {

/// A page on one trained tree for a browser: what it may be trusted with, tables, charts and pictures, all in
/// the one file. command: how it was made, for a shell.
std::string html_report(const TreeFile& tree, const BodyFigures& figures,
                        const std::vector<CoverageRow>& coverage, const std::string& command);

}  // namespace nbd
