#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "apps/extras/extras_request.hpp"
#include "sim/scene/scene.hpp"

// The files of a run: where its outputs go, and what an earlier run left there.
namespace nbd {

/// Output paths of a run: those of the command line, else those of the scene. A scene may come from anyone,
/// so that the paths in it stay within the working directory and the recording's folder, unless they may go
/// outside. scene_file: for messages. Throws CLI::RequiredError if nobody names a recording,
/// std::runtime_error on a path that leads outside.
SceneOutput output_paths(const SceneOutput& typed, const SceneOutput& scene, const std::string& scene_file,
                         bool outside);

/// The outputs besides the recording: path and content of each, one line each.
std::vector<std::string> other_outputs(const SceneOutput& paths);

/// Where a run keeps its frames until it is complete.
std::filesystem::path journal_path(const SceneOutput& paths);

/// Throws std::runtime_error unless all outputs can be written, each to a file or folder of its own, and none
/// is an input; and where the recording would replace a file that is not the recording of a scene.
void check_outputs(const SceneOutput& paths, const std::vector<std::filesystem::path>& inputs);

/// Options of the command line that change what a run of a scene computes: the name and the value of each,
/// without spaces. An empty value: not given.
using RunOptions = std::vector<std::pair<std::string, std::string>>;

/// Name of the recording's label with run_options_text().
inline constexpr const char* run_options_label = "options";

/// The options as one line: "--bounds=boxes --margin= --audit=3".
std::string run_options_text(const RunOptions& options);

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
