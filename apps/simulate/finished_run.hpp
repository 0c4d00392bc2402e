#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "apps/extras/extras_request.hpp"
#include "apps/simulate/run_options.hpp"
#include "apps/simulate/run_paths.hpp"

namespace nbd {

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
