#pragma once

#include <optional>
#include <string>
#include <vector>

#include "apps/cli/output.hpp"
#include "apps/commands/pose_argument.hpp"
#include "apps/view/view_scene.hpp"

namespace nbd {

/// What `view` is asked to show.
struct ViewArgument {
    std::string source;
    std::string scene;   // file or folder of the scene; empty: as the recording names it
    std::string body;    // body file of a trajectory; empty: none
    std::string bounds;  // of all bodies; empty: those of the scene
    std::optional<double> margin{};
    int frames = 300;  // most to be shown
};

/// The files that a source names.
std::vector<std::string> files_of(const ViewArgument& argument);

/// Reads the recording of a scene, `RECORDING.h5:trajectory[:frame]` with a body, `TREE.h5@POSE` as
/// read_pose() does, also of whole trajectories, or a surface file. Throws std::runtime_error or
/// std::invalid_argument, one line that names the wrong part.
ViewScene read_view(const ViewArgument& argument, Output& out);

struct NamedSurface {
    std::string name;
    PosedSurface posed;
    BoundKind bounds;  // for a pose with a tree
};

/// Shows surfaces in one pose. distance: of faces that are marked as near, metres. margin: see PosedTree.
ViewScene view_of_surfaces(const std::vector<NamedSurface>& surfaces, const std::string& title,
                           double distance, std::optional<float> margin);

}  // namespace nbd
