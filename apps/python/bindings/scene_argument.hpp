#pragma once

#include <pybind11/pybind11.h>

#include <vector>

#include "apps/cli/scene_files.hpp"
#include "sim/scene/scene.hpp"

namespace nbd::python {

namespace py = pybind11;

/// A scene as Python gives it: a path, or a dictionary whose bodies may name objects instead of files.
struct SceneArgument {
    /// folder: of relative paths in a dictionary; None: the current one. Throws what load_scene() throws, and
    /// std::invalid_argument for anything else.
    SceneArgument(py::handle scene, const py::object& folder);

    /// The bodies with their trees; files are read now. Without the GIL.
    std::vector<LoadedBody> load() const;

    SceneSpec spec;

 private:
    std::vector<LoadedBody> given_;  // [bodies] null pointers: from files
};

}  // namespace nbd::python
