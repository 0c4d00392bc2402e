#pragma once

#include <string>
#include <utility>
#include <vector>

namespace nbd {

/// Options of the command line that change what a run of a scene computes: the name and the value of each,
/// without spaces. An empty value: not given.
using RunOptions = std::vector<std::pair<std::string, std::string>>;

/// Name of the recording's label with run_options_text().
inline constexpr const char* run_options_label = "options";

/// The options as one line: "--bounds=boxes --margin= --audit=3 --contacts=".
std::string run_options_text(const RunOptions& options);

/// Names the first option whose value differs from that in `stored`, a text of run_options_text(), with both
/// values: "--audit 3 instead of no --audit". Empty if none differs.
std::string differing_option(const std::string& stored, const RunOptions& options);

/// Names of the options that are given, with commas between them.
std::string given_options(const RunOptions& options);

}  // namespace nbd
