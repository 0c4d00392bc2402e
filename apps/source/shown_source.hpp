#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "apps/cli/output.hpp"
#include "apps/view/make_view.hpp"
#include "training/files/recording.hpp"

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

/// What a recording holds for a page.
struct ShownRecording {
    ViewScene scene;  // has its times and numbers
    ViewSources sources;
    std::vector<std::filesystem::path> inputs{};  // that its scene names
    std::shared_ptr<const RecordingReader> recording{};
    int first = 0;  // trajectory of the first body; that of body b is first + b

    /// Reads the nodes of a body in a frame of the scene.
    void read_nodes(int body, int frame, Vertices& x) const;
};

/// The files that the argument names, for checks of outputs.
std::vector<std::filesystem::path> files_of(const SourceArgument& argument);

/// Whether the argument names the recording of a scene or frames of a trajectory; else it names a surface.
/// Throws std::invalid_argument for parts that do not go together.
bool names_recording(const SourceArgument& argument);

/// Opens what the argument names, if names_recording(). Throws one line that names the wrong part.
ShownRecording open_recording(const SourceArgument& argument, const Output& out);

/// Shows the frames of a recording, and tells its progress. Throws what reading throws, and
/// std::invalid_argument for bounds that a tree does not have.
ViewScene view_of_recording(ShownRecording shown);

/// Shows one pose of a surface: SURFACE, or TREE.h5@SURFACE.
ViewScene view_of_surface(const SourceArgument& argument);

}  // namespace nbd
