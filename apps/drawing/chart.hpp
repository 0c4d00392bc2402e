#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace nbd {

/// Throws std::runtime_error, which says what to install, unless charts can be drawn on this machine.
void check_charts();

/// Draws a chart of a table by draw_charts.py, which lies beside the program or in ../share/nbdtree.
/// chart: one that the script lists. picture: .png or .svg, written under a temporary name and renamed. more:
/// further options of the script. Throws std::runtime_error with what the script says.
void draw_chart(const std::string& chart, const std::filesystem::path& table,
                const std::filesystem::path& picture, const std::vector<std::string>& more = {});

}  // namespace nbd
