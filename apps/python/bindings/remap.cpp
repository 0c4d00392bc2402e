#include <fmt/format.h>
#include <pybind11/stl/filesystem.h>

#include "apps/cli/output_paths.hpp"
#include "apps/cli/remap_recording.hpp"
#include "apps/python/bindings/bindings.hpp"
#include "apps/python/bindings/long_call.hpp"

namespace nbd::python {
namespace {

using std::filesystem::path;

int remap(const path& recording, const path& output, const Body& source, const Body& target,
          int trajectories) {
    if (trajectories < 0)
        throw std::invalid_argument(
            fmt::format("trajectories: is {}; allowed: 0 or more, 0 for all", trajectories));
    check_output(output.string(), {recording.string()});
    return stoppable<FileCall>([&] {
        return remap_recording(recording, {source, source.name}, {target, target.name}, output, trajectories,
                               [](int, int) {})
            .frames;
    });
}

}  // namespace

void bind_remap(py::module_& m) {
    m.def("remap", &remap, py::arg("recording"), py::arg("path"), py::arg("source"), py::arg("target"),
          py::arg("trajectories") = 0,
          "Writes a recording of the body `source` as one of `target`, which has the same tetrahedra and "
          "another "
          "surface, as `nbdtree remap`. trajectories: at most so many, from the first; 0: all. Returns the "
          "number "
          "of frames. Raises RuntimeError where the bodies or the recording do not fit; nothing is written "
          "then.");
}

}  // namespace nbd::python
