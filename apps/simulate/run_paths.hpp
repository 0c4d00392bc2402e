#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "sim/scene/scene.hpp"

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

}  // namespace nbd
