#include <fmt/format.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <algorithm>

#include "apps/cli/load_body.hpp"
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
    const LongCall call;
    const SurfaceBody surface = surface_body(body);
    auto tree = std::make_shared<CollisionTree>(make_exact_tree(surface.X, surface.F, {.depth = depth}));
    hang_on_solid(*tree, surface);
    return tree;
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
    Eigen::Matrix<float, Eigen::Dynamic, 4, Eigen::RowMajor> rows(static_cast<Eigen::Index>(rest.size()), 4);
    for (Eigen::Index i = 0; i < rows.rows(); ++i) {
        const Sphere& sphere = rest[static_cast<std::size_t>(i)];
        rows.row(i) << sphere.c.transpose(), sphere.r;
    }
    return owned(std::move(rows));
}

void check_node(const CollisionTree& tree, int node) {
    if (node < 0 || node >= static_cast<int>(tree.spheres.nodes.size()))
        throw py::index_error(
            fmt::format("node: is {}; allowed: 0..{}", node, tree.spheres.nodes.size() - 1));
}

std::unique_ptr<PosedTreeObject> posed_tree(const SharedTree& tree, const std::string& bounds,
                                            std::optional<float> margin) {
    const BoundKind kind = bound_kind(bounds);
    const LongCall call;
    return std::make_unique<PosedTreeObject>(tree, kind, margin);
}

void begin_pose(PosedTreeObject& self, py::handle x, bool check) {
    const ReferredVertices positions(x, "x", self.tree.tree().vertex_count, check);
    const Use use(self.lock, "PosedTree");
    {
        const LongCall call;
        self.tree.begin_pose(positions.vertices());
    }
    self.refers_to = {positions.owner(), py::none()};
}

Eigen::Index carrying_nodes(const PosedTreeObject& self) {
    const CollisionTree& tree = self.tree.tree();
    const BoundKind kind = self.tree.kind();
    if (!tree.affine || (kind != BoundKind::affine && kind != BoundKind::automatic))
        throw std::invalid_argument(
            fmt::format("PosedTree: poses of nodes need affine or auto bounds and a tree that hangs on "
                        "nodes; these are {}",
                        name(kind)));
    return tree.affine->node_count();
}

void begin_pose_of_nodes(PosedTreeObject& self, py::handle x, bool check) {
    const ReferredVertices nodes(x, "nodes", carrying_nodes(self), check);
    const Use use(self.lock, "PosedTree");
    {
        const LongCall call;
        self.tree.begin_pose_of_nodes(nodes.vertices());
    }
    self.refers_to = {nodes.owner(), py::none()};
}

void begin_step(PosedTreeObject& self, py::handle x, py::handle y, bool check) {
    const Eigen::Index rows = self.tree.tree().vertex_count;
    const ReferredVertices start(x, "start", rows, check), end(y, "end", rows, check);
    const Use use(self.lock, "PosedTree");
    {
        const LongCall call;
        self.tree.begin_step(start.vertices(), end.vertices());
    }
    self.refers_to = {start.owner(), end.owner()};
}

py::tuple sphere_of(PosedTreeObject& self, int node) {
    check_node(self.tree.tree(), node);
    const Use use(self.lock, "PosedTree");
    const Sphere& sphere = self.tree.sphere(node);
    return py::make_tuple(owned(Eigen::Vector3f(sphere.c)), sphere.r);
}

py::tuple corners(const Box& box) {
    return py::make_tuple(owned(Eigen::Vector3f(box.lo.head<3>())), owned(Eigen::Vector3f(box.hi.head<3>())));
}

py::object box_of(PosedTreeObject& self, int node) {
    check_node(self.tree.tree(), node);
    const Use use(self.lock, "PosedTree");
    const std::optional<Box> box = self.tree.box(node);
    return box ? py::object(corners(*box)) : py::none();
}

void bind_posed_tree(py::module_& m) {
    py::class_<PosedTreeObject>(
        m, "PosedTree", py::is_final(),
        "A body's collision tree in its current pose. One thread at a time may use it.")
        .def(py::init(&posed_tree), py::arg("tree").none(false), py::arg("bounds") = "boxes",
             py::arg("margin") = py::none(),
             "tree: shared, not copied. bounds: one of tree.bounds. margin: relative, >= 0, instead of the "
             "tree's calibration; bounds that can miss need one of the two.")
        .def("begin_pose", &begin_pose, py::arg("x"), py::arg("check") = true,
             "Starts a pose. x: positions of the surface [n, 3], float32 and contiguous. The array is "
             "referred "
             "to, not copied, and kept alive; do not change it before the next pose. check: whether to look "
             "for numbers that are not finite, which must not be there.")
        .def("begin_pose_of_nodes", &begin_pose_of_nodes, py::arg("nodes"), py::arg("check") = true,
             "Likewise from the nodes that carry the surface [N, 3]: for affine and auto bounds.")
        .def("begin_step", &begin_step, py::arg("start"), py::arg("end"), py::arg("check") = true,
             "Starts a step of linear motion between two arrays as begin_pose() takes them: boxes_within() "
             "then answers for the whole step.")
        .def("sphere", &sphere_of, py::arg("node"), "Centre [3] and radius of a node in this pose.")
        .def("box", &box_of, py::arg("node"), "Corners of a node's box; None for bounds that are spheres.")
        .def(
            "whole",
            [](PosedTreeObject& self) {
                const Use use(self.lock, "PosedTree");
                return corners(self.tree.whole());
            },
            "Corners of a box around the whole body.")
        .def_property_readonly("nodes_bounded",
                               [](const PosedTreeObject& self) { return self.tree.nodes_bounded(); })
        .def_property_readonly("nodes_out_of_range",
                               [](const PosedTreeObject& self) { return self.tree.nodes_out_of_range(); })
        .def_property_readonly(
            "bounds", [](const PosedTreeObject& self) { return std::string(name(self.tree.kind())); })
        .def_property_readonly(
            "chosen", [](const PosedTreeObject& self) { return std::string(name(self.tree.chosen())); },
            "The bounds that the last query used: those that auto chose, else `bounds`.");
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
            const LongCall call;
            save_flat_tree(file, tree);
        },
        py::arg("path"), py::arg("tree"), "Writes a flat file.");
    bind_posed_tree(m);
}

}  // namespace nbd::python
