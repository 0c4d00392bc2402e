#include <fmt/format.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <stdexcept>
#include <utility>
#include <vector>

#include "apps/python/bindings/bindings.hpp"
#include "apps/python/bindings/shared_tree.hpp"

namespace nbd::python {
namespace {

void check_node(const CollisionTree& tree, int node) {
    if (node < 0 || node >= std::ssize(tree.spheres.nodes))
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
    self.pose([&] { self.tree.begin_pose(positions.vertices()); }, positions.owner());
}

Eigen::Index carrying_nodes(const PosedTreeObject& self) {
    if (!self.tree.takes_nodes())
        throw std::invalid_argument(
            fmt::format("PosedTree: poses of nodes need affine or auto bounds and a tree that hangs on "
                        "nodes; these are {}",
                        name(self.tree.kind())));
    return self.tree.tree().affine->node_count();
}

void begin_pose_of_nodes(PosedTreeObject& self, py::handle x, bool check) {
    const ReferredVertices nodes(x, "nodes", carrying_nodes(self), check);
    const Use use(self.lock, "PosedTree");
    self.pose([&] { self.tree.begin_pose_of_nodes(nodes.vertices()); }, nodes.owner());
}

void begin_step(PosedTreeObject& self, py::handle x, py::handle y, bool check) {
    const Eigen::Index rows = self.tree.tree().vertex_count;
    const ReferredVertices start(x, "start", rows, check), end(y, "end", rows, check);
    const Use use(self.lock, "PosedTree");
    self.pose([&] { self.tree.begin_step(start.vertices(), end.vertices()); }, start.owner(), end.owner());
}

/// Marks the tree as used, as UsePoses does. Throws std::runtime_error before the first pose.
UsePoses use_pose(PosedTreeObject& self) {
    if (!self.refers_to[0]) throw std::runtime_error("PosedTree: has no pose yet; call begin_pose() first");
    PosedTreeObject* const one[] = {&self};
    return UsePoses(one);
}

py::tuple sphere_of(PosedTreeObject& self, int node) {
    check_node(self.tree.tree(), node);
    const UsePoses use = use_pose(self);
    const Sphere& sphere = self.tree.sphere(node);
    return py::make_tuple(owned(Eigen::Vector3f(sphere.c)), sphere.r);
}

py::tuple corners(const Box& box) {
    return py::make_tuple(owned(Eigen::Vector3f(box.lo.head<3>())), owned(Eigen::Vector3f(box.hi.head<3>())));
}

}  // namespace

UsePoses::UsePoses(std::span<PosedTreeObject* const> trees) {
    std::vector<PosingWorld*> worlds;
    for (PosedTreeObject* tree : trees) {
        uses_.emplace_back(tree->lock, "PosedTree");
        PosingWorld* world = tree->world.get();
        if (!world) continue;
        if (std::ranges::find(worlds, world) == worlds.end()) {
            worlds.push_back(world);
            uses_.emplace_back(world->lock, "the World of a PosedTree");
        }
        if (world->changes != tree->world_changes)
            throw std::runtime_error(
                "PosedTree: its world has moved since the pose; call World.begin_pose() again");
    }
}

void bind_posed_trees(py::module_& m) {
    py::class_<PosedTreeObject>(
        m, "PosedTree", py::is_final(),
        "A body's collision tree in its current pose. One thread at a time may use it.")
        .def(py::init(&posed_tree), py::arg("tree").none(false), py::arg("bounds") = "boxes",
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
        .def(
            "whole",
            [](PosedTreeObject& self) {
                const UsePoses use = use_pose(self);
                return corners(self.tree.whole());
            },
            "Corners of a box around the whole body, metres.")
        .def_property_readonly("nodes_bounded",
                               [](PosedTreeObject& self) {
                                   const Use use(self.lock, "PosedTree");
                                   return self.tree.nodes_bounded();
                               })
        .def_property_readonly("nodes_out_of_range",
                               [](PosedTreeObject& self) {
                                   const Use use(self.lock, "PosedTree");
                                   return self.tree.nodes_out_of_range();
                               })
        .def_property_readonly(
            "bounds", [](const PosedTreeObject& self) { return std::string(name(self.tree.kind())); })
        .def_property_readonly(
            "chosen",
            [](PosedTreeObject& self) {
                const Use use(self.lock, "PosedTree");
                return std::string(name(self.tree.chosen()));
            },
            "The bounds in this pose or step: `bounds`, those that auto chose, or the exact boxes in their place.");
}

}  // namespace nbd::python
