#pragma once

#include <filesystem>
#include <vector>

#include "apps/extras/extras_request.hpp"
#include "apps/simulate/run_paths.hpp"

namespace nbd {

/// Whether an earlier run has written all outputs, and no input has changed since. frames: that a recording
/// holds in the end.
bool is_finished(const SceneOutput& paths, const std::vector<std::filesystem::path>& inputs, int frames,
                 const ExtrasRequest& extras);

/// Throws std::runtime_error where the recording is whole and that of another scene or of other frames, which
/// a run that is to be continued must not replace.
void check_no_other_run(const SceneOutput& paths, const SceneSpec& spec);

}  // namespace nbd
