#include "apps/python/bindings/scene_argument.hpp"

#include <fmt/format.h>
#include <pybind11/stl/filesystem.h>

#include <memory>
#include <stdexcept>
#include <string>

#include "apps/cli/load_body.hpp"
#include "apps/cli/output.hpp"
#include "apps/python/bindings/shared_tree.hpp"
#include "meshing/body/body.hpp"

namespace nbd::python {
namespace {

/// Takes an object of class T out of a body's entry and leaves a text in its place; null if none is there.
template <class T>
std::shared_ptr<const T> take(py::dict& entry, const char* key) {
    if (!entry.contains(key) || !py::isinstance<T>(entry[key])) return nullptr;
    auto object = entry[key].cast<std::shared_ptr<T>>();
    entry[key] = "an object in memory";
    return object;
}

void check_tree(const LoadedBody& body, std::size_t number) {
    if (!body.tree) return;
    if (!body.body)
        throw std::invalid_argument(fmt::format(
            "bodies[{}].tree: is an object; allowed: beside a body that is an object, too", number));
    if (body.tree->vertex_count != body.body->surface.X.rows() || body.tree->faces != body.body->surface.F)
        throw std::invalid_argument(
            fmt::format("bodies[{}].tree: is of another surface than the body", number));
}

}  // namespace

SceneArgument::SceneArgument(py::handle scene, const py::object& folder) {
    if (!py::hasattr(scene, "keys")) {
        spec = load_scene(path_from(scene, "scene"));
        given_.resize(spec.bodies.size());
        return;
    }
    const auto copy = py::module_::import("copy").attr("copy");
    py::dict top;  // a copy: the caller's dictionary stays as it is
    top.attr("update")(scene);
    if (top.contains("bodies") && py::isinstance<py::sequence>(top["bodies"])) {
        py::list bodies;
        for (const py::handle body : top["bodies"]) {
            LoadedBody given;
            py::object entry = copy(body);
            if (py::isinstance<py::dict>(entry)) {
                auto keys = py::reinterpret_borrow<py::dict>(entry);
                given.body = take<Body>(keys, "body");
                given.tree = take<CollisionTree>(keys, "tree");
                check_tree(given, given_.size());
            }
            given_.push_back(given);
            bodies.append(entry);
        }
        top["bodies"] = bodies;
    }
    const std::string text = py::module_::import("json").attr("dumps")(top).cast<std::string>();
    spec =
        parse_scene(text, folder.is_none() ? std::filesystem::current_path() : path_from(folder, "folder"));
    given_.resize(spec.bodies.size());
}

std::vector<LoadedBody> SceneArgument::load() const {
    Output silent;
    silent.quiet = true;
    SceneFiles files;
    std::vector<LoadedBody> bodies;
    for (std::size_t b = 0; b < spec.bodies.size(); ++b) {
        const SceneBody& body = spec.bodies[b];
        LoadedBody loaded = given_[b];
        if (!loaded.body) {
            loaded = files.load(body, silent);
        } else if (!loaded.tree && !body.tree.empty()) {
            TreeFile file = load_tree_of(body.name, body_hash(*loaded.body), body.tree);
            loaded.tree = std::make_shared<const CollisionTree>(std::move(file.tree));
        }
        bodies.push_back(std::move(loaded));
    }
    make_trees(spec, bodies);
    return bodies;
}

}  // namespace nbd::python
