#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "apps/cli/output.hpp"
#include "apps/view/make_view.hpp"

namespace nbd {

/// What the command line names to be shown.
struct SourceArgument {
    std::string
        source;  // RECORDING.h5, RECORDING.h5:trajectory[:frame], either with TREE.h5@ in front, or a surface
    std::string scene;   // file or folder of the scene; empty: as the recording names it
    std::string body;    // body file of a trajectory; empty: none
    std::string bounds;  // of all bodies; empty: those of the scene
    std::optional<double> margin{};
    int frames = 300;  // most to be shown
};

/// The files that the argument names, for checks of outputs.
std::vector<std::filesystem::path> files_of(const SourceArgument& argument);

/// Whether the argument names the recording of a scene or frames of a trajectory; else it names a surface.
/// Throws std::invalid_argument for parts that do not go together.
bool names_recording(const SourceArgument& argument);

/// Opens what the argument names, if names_recording(). Throws one line that names the wrong part.
ShownRecording open_recording(const SourceArgument& argument, const Output& out);

/// Shows one pose of a surface: SURFACE, or TREE.h5@SURFACE.
ViewScene view_of_surface(const SourceArgument& argument);

}  // namespace nbd
