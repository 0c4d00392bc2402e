#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "apps/extras/extras_request.hpp"
#include "apps/simulate/run_paths.hpp"

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

/// What a run that may be continued is to compute.
struct WantedRun {
    const SceneSpec& spec;
    const std::vector<std::filesystem::path>& inputs;
    const ExtrasRequest& extras;
    const RunOptions& options;
};

/// What an earlier run left at the paths of the outputs.
struct EarlierRun {
    bool is_finished = false;   // all outputs are written, and no input has changed since
    bool tells_options = true;  // false: a recording of an earlier version, without the run's options
};

/// Looks at the outputs of an earlier run. Throws std::runtime_error where its recording is whole and that of
/// another scene, of other frames or with other options, which a run that is to be continued must not
/// replace.
EarlierRun find_earlier_run(const SceneOutput& paths, const WantedRun& wanted);

}  // namespace nbd
