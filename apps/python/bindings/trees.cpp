#include <fmt/format.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <algorithm>

#include "apps/cli/load_body.hpp"
#include "apps/cli/output_paths.hpp"
#include "apps/python/bindings/bindings.hpp"
#include "apps/python/bindings/shared_tree.hpp"
#include "collision/flat/flat_tree.hpp"
#include "meshing/body/body.hpp"

namespace nbd::python {
namespace {

using std::filesystem::path;

SharedTree exact_tree(py::handle X, py::handle F, int depth, int min_leaf_faces) {
    const VertexRows vertices(X, "X", 3);
    const IndexRows faces(F, "F", 3);
    const LongCall call;
    return std::make_shared<CollisionTree>(make_exact_tree(
        vertices.as<Vertices>(), faces.as<Faces>(), {.depth = depth, .min_leaf_faces = min_leaf_faces}));
}

SharedTree tree_of_body(const Body& body, int depth) {
    return stoppable([&] {
        const SurfaceBody surface = surface_body(body);
        auto tree = std::make_shared<CollisionTree>(make_exact_tree(surface.X, surface.F, {.depth = depth}));
        hang_on_solid(*tree, surface);
        return tree;
    });
}

SharedTree on_nodes(const CollisionTree& tree, py::handle W, py::handle rest) {
    const VertexRows nodes(rest, "rest", 3);
    const SurfaceEmbedding weights = embedding_from(W, "W", nodes.count()).cast<float>();
    auto copy = std::make_shared<CollisionTree>(tree);
    const LongCall call;
    hang_on_nodes(*copy, weights, nodes.as<Vertices>());
    return copy;
}

std::vector<std::string> bounds_of(const CollisionTree& tree) {
    std::vector<std::string> names;
    for (const BoundKind kind : bound_kinds)
        if (has_bounds(tree, kind)) names.emplace_back(name(kind));
    return names;
}

py::dict calibrations_of(const CollisionTree& tree) {
    py::dict all;
    for (const auto& [kind, calibration] : tree.calibrations) {
        py::dict entry;
        entry["miss_rate"] = calibration.miss_rate;
        entry["confidence"] = calibration.confidence;
        entry["trajectories"] = calibration.trajectories;
        entry["poses"] = calibration.poses;
        entry["margins"] = owned(calibration.margins);
        all[py::str(std::string(name(kind)))] = entry;
    }
    return all;
}

/// [nodes, 4]: centre and radius of each rest sphere.
py::array rest_spheres(const CollisionTree& tree) {
    const auto& rest = tree.spheres.rest;
    Eigen::Matrix<float, Eigen::Dynamic, 4, Eigen::RowMajor> rows(rest.size(), 4);
    for (Eigen::Index i = 0; i < rows.rows(); ++i) {
        const Sphere& sphere = rest[i];
        rows.row(i) << sphere.c.transpose(), sphere.r;
    }
    return owned(std::move(rows));
}

}  // namespace

void bind_trees(py::module_& m) {
    py::class_<CollisionTree, SharedTree>(
        m, "CollisionTree", "What collision queries need to know about a body, whatever its pose.")
        .def_readonly("vertex_count", &CollisionTree::vertex_count)
        .def_property_readonly(
            "faces", [](py::object self) { return view(self.cast<const CollisionTree&>().faces, self); },
            "Faces of the surface [m, 3]. Refers to the tree.")
        .def_property_readonly("node_count",
                               [](const CollisionTree& tree) { return tree.spheres.nodes.size(); })
        .def_property_readonly("depth", [](const CollisionTree& tree) { return tree.spheres.depth(); })
        .def_property_readonly("rest_spheres", &rest_spheres,
                               "Centre and radius of each node at rest, [nodes, 4]. A new array.")
        .def_property_readonly(
            "node_depths",
            [](const CollisionTree& tree) {
                std::vector<int> depths;
                for (const SphereTree::Node& node : tree.spheres.nodes) depths.push_back(node.depth);
                return owned(std::move(depths));
            },
            "Depth of each node, 0 at the root. A new array.")
        .def_property_readonly("bounds", &bounds_of, "Names of the bounds that the tree has.")
        .def_property_readonly("calibrations", &calibrations_of, "What is stated of bounds that can miss.")
        .def("on_nodes", &on_nodes, py::arg("W"), py::arg("rest"),
             "The same tree with affine bounds for a surface that hangs on nodes, x = W nodes. W: (data, "
             "indices, indptr) or a csr_matrix; rest: rest positions of the nodes [N, 3].")
        .def("__repr__", [](const CollisionTree& tree) {
            return fmt::format("<nbdtree.CollisionTree: {} faces, {} nodes, bounds {}>", tree.faces.rows(),
                               tree.spheres.nodes.size(), fmt::join(bounds_of(tree), ", "));
        });
    m.def("make_exact_tree", &exact_tree, py::arg("X"), py::arg("F"), py::arg("depth") = 7,
          py::arg("min_leaf_faces") = 4,
          "A tree with exact bounds, without training. X: rest positions [n, 3]; F: faces [m, 3].");
    m.def("tree_of_body", &tree_of_body, py::arg("body"), py::arg("depth") = 7,
          "A tree over a body's surface with exact bounds, affine ones too.");
    m.def(
        "load_flat_tree",
        [](const path& file) {
            const LongCall call;
            return std::make_shared<CollisionTree>(load_flat_tree(file));
        },
        py::arg("path"), "Reads the tree in a flat file, which `nbdtree export` writes.");
    m.def(
        "save_flat_tree",
        [](const path& file, const CollisionTree& tree) {
            check_output(file, {});
            const LongCall call;
            save_flat_tree(file, tree);
        },
        py::arg("path"), py::arg("tree"), "Writes a flat file.");
}

}  // namespace nbd::python
