#pragma once

#include <pybind11/pybind11.h>

#include <array>
#include <deque>
#include <memory>
#include <optional>
#include <span>

#include "apps/python/bindings/arrays.hpp"
#include "apps/python/bindings/long_call.hpp"
#include "collision/tree/posed_tree.hpp"

namespace nbd::python {

using SharedTree = std::shared_ptr<CollisionTree>;

/// A world as the poses of trees see it.
struct PosingWorld : Lockable {
    PosingWorld() : Lockable("World") {}
    long changes = 0;  // of positions; a pose is valid until the next one
};

/// A posed tree, with what its pose refers to.
struct PosedTreeObject : Lockable {
    PosedTreeObject(const SharedTree& shared, BoundKind kind, std::optional<float> margin)
        : Lockable("PosedTree"), tree(shared, kind, margin) {}

    /// Starts a pose by start(), as a long call. The pose refers to these objects of the caller from then on.
    /// There is none if start() throws.
    template <class Start>
    void pose(const Start& start, py::object first, py::object second = py::none()) {
        const auto before = std::exchange(refers_to, {});  // until the pose that they belong to has ended
        world.reset();
        long_call(start);
        refers_to = {std::move(first), std::move(second)};
    }

    PosedTree tree;
    std::array<py::object, 2> refers_to;  // none before the first pose
    std::shared_ptr<PosingWorld> world;   // null: the pose is of arrays
    long world_changes = 0;               // PosingWorld::changes of the pose
};

/// Marks posed trees, and the worlds that their poses refer to, as used while alive. Throws
/// std::runtime_error where another thread uses one of them, or where a world has moved since the pose.
class UsePoses {
 public:
    explicit UsePoses(std::span<PosedTreeObject* const> trees);

 private:
    std::deque<Use> uses_;
};

}  // namespace nbd::python
