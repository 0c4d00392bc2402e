#pragma once

#include <pybind11/pybind11.h>

#include <array>
#include <memory>

#include "apps/python/bindings/arrays.hpp"
#include "apps/python/bindings/long_call.hpp"
#include "collision/tree/posed_tree.hpp"

namespace nbd::python {

using SharedTree = std::shared_ptr<CollisionTree>;

/// A posed tree, with the arrays that its pose refers to.
struct PosedTreeObject {
    PosedTreeObject(const SharedTree& shared, BoundKind kind, std::optional<float> margin)
        : tree(shared, kind, margin) {}

    PosedTree tree;
    std::array<py::object, 2> refers_to;  // none before the first pose
    Lockable lock;
};

}  // namespace nbd::python
