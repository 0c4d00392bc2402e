#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <memory>
#include <optional>
#include <span>
#include <stdexcept>
#include <string_view>
#include <utility>
#include <vector>

#include "apps/cli/load_body.hpp"
#include "apps/python/bindings/arrays.hpp"
#include "apps/python/bindings/bindings.hpp"
#include "apps/python/bindings/long_call.hpp"
#include "apps/python/bindings/shared_tree.hpp"
#include "apps/python/bindings/typed.hpp"
#include "collision/flat/flat_tree.hpp"
#include "meshing/body/body.hpp"

namespace nbd::python {

UsePoses::UsePoses(std::span<PosedTreeObject* const> trees) {
    std::vector<PosingWorld*> worlds;
    for (PosedTreeObject* tree : trees) {
        uses_.emplace_back(*tree);
        PosingWorld* world = tree->world.get();
        if (!world) continue;
        if (std::ranges::find(worlds, world) == worlds.end()) {
            worlds.push_back(world);
            uses_.emplace_back(*world, "the World of a PosedTree");
        }
        if (world->changes != tree->world_changes)
            throw std::runtime_error(
                "PosedTree: its world has moved since the pose; call World.begin_pose() again");
    }
}

namespace {

SharedTree exact_tree(const Rows<Vertices, "X">& X, const Rows<Faces, "F">& F, int depth,
                      int min_leaf_faces) {
    return std::make_shared<CollisionTree>(
        make_exact_tree(*X, *F, {.depth = depth, .min_leaf_faces = min_leaf_faces}));
}

SharedTree tree_of_body(const Body& body, int depth) {
    const SurfaceBody surface = surface_body(body);
    auto tree = std::make_shared<CollisionTree>(make_exact_tree(surface.X, surface.F, {.depth = depth}));
    hang_on_solid(*tree, surface);
    return tree;
}

SharedTree on_nodes(const CollisionTree& tree, const Typed<"Any">& W, const Rows<Vertices, "rest">& rest) {
    const SurfaceEmbedding weights = embedding_from(W, "W", rest.count()).cast<float>();
    auto copy = std::make_shared<CollisionTree>(tree);
    const LongCall call;
    hang_on_nodes(*copy, weights, *rest);
    return copy;
}

std::vector<BoundKind> bounds_of(const CollisionTree& tree) {
    std::vector<BoundKind> kinds;
    std::ranges::copy_if(bound_kinds, std::back_inserter(kinds),
                         [&](BoundKind kind) { return has_bounds(tree, kind); });
    return kinds;
}

Typed<"dict[str, CalibrationFacts]"> calibrations_of(const CollisionTree& tree) {
    py::dict all;
    for (const auto& [kind, calibration] : tree.calibrations)
        all[py::cast(kind)] = py::dict(
            py::arg("miss_rate") = calibration.miss_rate, py::arg("confidence") = calibration.confidence,
            py::arg("trajectories") = calibration.trajectories, py::arg("poses") = calibration.poses,
            py::arg("margins") = column(calibration.margins));
    return all;
}

/// [nodes, 4]: centre and radius of each rest sphere.
Eigen::Matrix<float, Eigen::Dynamic, 4, Eigen::RowMajor> rest_spheres(const CollisionTree& tree) {
    const auto& rest = tree.spheres.rest;
    Eigen::Matrix<float, Eigen::Dynamic, 4, Eigen::RowMajor> rows(rest.size(), 4);
    for (Eigen::Index i = 0; i < rows.rows(); ++i) {
        const Sphere& sphere = rest[i];
        rows.row(i) << sphere.c.transpose(), sphere.r;
    }
    return rows;
}

using UsedTree = Used<PosedTreeObject>;

std::unique_ptr<PosedTreeObject> posed_tree(const SharedTree& tree, BoundKind kind,
                                            std::optional<float> margin) {
    const LongCall call;
    return std::make_unique<PosedTreeObject>(tree, kind, margin);
}

void begin_pose(const UsedTree& self, const Typed<"Floats">& x, bool check) {
    const ReferredVertices positions(x, "x", self->tree.tree().vertex_count, check);
    self->pose([&] { self->tree.begin_pose(positions.vertices()); }, positions.owner());
}

void begin_pose_of_nodes(const UsedTree& self, const Typed<"Floats">& x, bool check) {
    if (!self->tree.takes_nodes())
        throw std::invalid_argument(
            fmt::format("PosedTree: poses of nodes need affine or auto bounds and a tree that hangs on "
                        "nodes; these are {}",
                        name(self->tree.kind())));
    const ReferredVertices nodes(x, "nodes", self->tree.tree().affine->node_count(), check);
    self->pose([&] { self->tree.begin_pose_of_nodes(nodes.vertices()); }, nodes.owner());
}

void begin_step(const UsedTree& self, const Typed<"Floats">& x, const Typed<"Floats">& y, bool check) {
    const Eigen::Index rows = self->tree.tree().vertex_count;
    const ReferredVertices start(x, "start", rows, check), end(y, "end", rows, check);
    self->pose([&] { self->tree.begin_step(start.vertices(), end.vertices()); }, start.owner(), end.owner());
}

/// Marks the tree as used, as UsePoses does. Throws std::runtime_error before the first pose.
UsePoses use_pose(PosedTreeObject& self) {
    if (!self.refers_to[0]) throw std::runtime_error("PosedTree: has no pose yet; call begin_pose() first");
    PosedTreeObject* const one[] = {&self};
    return UsePoses(one);
}

std::pair<Eigen::Vector3f, float> sphere_of(PosedTreeObject& self, int node) {
    if (const auto count = std::ssize(self.tree.tree().spheres.nodes); node < 0 || node >= count)
        throw py::index_error(fmt::format("node: is {}; allowed: 0..{}", node, count - 1));
    const UsePoses use = use_pose(self);
    const Sphere& sphere = self.tree.sphere(node);
    return {Eigen::Vector3f(sphere.c), sphere.r};
}

std::pair<Eigen::Vector3f, Eigen::Vector3f> corners_of(PosedTreeObject& self) {
    const UsePoses use = use_pose(self);
    const Box whole = self.tree.whole();
    return {Eigen::Vector3f(whole.lo.head<3>()), Eigen::Vector3f(whole.hi.head<3>())};
}

void bind_posed_trees(py::module_& m) {
    py::class_<PosedTreeObject>(
        m, "PosedTree", py::is_final(),
        "A body's collision tree in its current pose. One thread at a time may use it.")
        .def(py::init(&posed_tree), py::arg("tree").none(false), py::arg("bounds") = BoundKind::boxes,
             py::arg("margin") = py::none(),
             "tree: shared, not copied. bounds: one of tree.bounds. margin: relative, >= 0, instead of the "
             "tree's calibration; bounds that can miss need one of the two.")
        .def(
            "begin_pose", &begin_pose, py::arg("x"), py::arg("check") = true,
            "Starts a pose. x: positions of the surface [n, 3], float32 and contiguous, metres. The array is "
            "referred to, not copied, and kept alive; do not change it before the next pose. check: whether "
            "to look for numbers that are not finite, which must not be there. Raises ValueError for an "
            "array that needs a copy.")
        .def("begin_pose_of_nodes", &begin_pose_of_nodes, py::arg("nodes"), py::arg("check") = true,
             "Likewise from the nodes that carry the surface [N, 3], metres: for affine and auto bounds.")
        .def("begin_step", &begin_step, py::arg("start"), py::arg("end"), py::arg("check") = true,
             "Starts a step of linear motion between two arrays as begin_pose() takes them: boxes_within() "
             "then answers for the whole step.")
        .def("sphere", &sphere_of, py::arg("node"),
             "Centre [3] and radius of a node in this pose, metres: of exact, bd and nbd bounds. Raises "
             "RuntimeError before the first pose.")
        .def("whole", &corners_of, "Corners of a box around the whole body, metres.")
        .def_property_readonly("nodes_bounded",
                               [](const UsedTree& self) { return self->tree.nodes_bounded(); })
        .def_property_readonly("nodes_out_of_range",
                               [](const UsedTree& self) { return self->tree.nodes_out_of_range(); })
        .def_property_readonly("bounds", [](const PosedTreeObject& self) { return self.tree.kind(); })
        .def_property_readonly(
            "chosen", [](const UsedTree& self) { return self->tree.chosen(); },
            "The bounds in this pose or step: `bounds`, those that auto chose, or the exact boxes in their place.");
}

}  // namespace

void bind_trees(py::module_& m) {
    py::class_<CollisionTree, SharedTree>(
        m, "CollisionTree", "What collision queries need to know about a body, whatever its pose.")
        .def_readonly("vertex_count", &CollisionTree::vertex_count)
        .def_readonly("faces", &CollisionTree::faces, "Faces of the surface [m, 3]. Refers to the tree.")
        .def_property_readonly("node_count",
                               [](const CollisionTree& tree) { return tree.spheres.nodes.size(); })
        .def_property_readonly("depth", [](const CollisionTree& tree) { return tree.spheres.depth(); })
        .def_property_readonly("rest_spheres", &rest_spheres,
                               "Centre and radius of each node at rest, [nodes, 4]. A new array.")
        .def_property_readonly(
            "node_depths",
            [](const CollisionTree& tree) {
                Eigen::VectorXi depths(std::ssize(tree.spheres.nodes));
                std::ranges::transform(tree.spheres.nodes, depths.begin(), &SphereTree::Node::depth);
                return depths;
            },
            "Depth of each node, 0 at the root. A new array.")
        .def_property_readonly("bounds", &bounds_of, "Names of the bounds that the tree has.")
        .def_property_readonly("calibrations", &calibrations_of, "What is stated of bounds that can miss.")
        .def("on_nodes", &on_nodes, py::arg("W"), py::arg("rest"),
             "The same tree with affine bounds for a surface that hangs on nodes, x = W nodes. W: (data, "
             "indices, indptr) or a csr_matrix; rest: rest positions of the nodes [N, 3].")
        .def("__repr__", [](const CollisionTree& tree) {
            std::vector<std::string_view> names;
            for (const BoundKind kind : bounds_of(tree)) names.push_back(name(kind));
            return fmt::format("<nbdtree.CollisionTree: {} faces, {} nodes, bounds {}>", tree.faces.rows(),
                               tree.spheres.nodes.size(), fmt::join(names, ", "));
        });
    m.def("make_exact_tree", &exact_tree, py::arg("X"), py::arg("F"), py::arg("depth") = 7,
          py::arg("min_leaf_faces") = 4, Computes(),
          "A tree with exact bounds, without training. X: rest positions [n, 3]; F: faces [m, 3].");
    m.def("tree_of_body", &tree_of_body, py::arg("body"), py::arg("depth") = 7, ComputesLong(),
          "A tree over a body's surface with exact bounds, affine ones too.");
    m.def(
        "load_flat_tree",
        [](const std::filesystem::path& file) {
            return std::make_shared<CollisionTree>(load_flat_tree(file));
        },
        py::arg("path"), Computes(), "Reads the tree in a flat file, which `nbdtree export` writes.");
    m.def("save_flat_tree", &write_checked<save_flat_tree, CollisionTree>, py::arg("path"), py::arg("tree"),
          Computes(), "Writes a flat file.");
    bind_posed_trees(m);
}

}  // namespace nbd::python
