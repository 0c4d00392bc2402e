#pragma once

#include <fmt/format.h>

#include <memory>
#include <utility>
#include <vector>

#include "apps/python/bindings/bindings.hpp"
#include "apps/python/bindings/long_call.hpp"
#include "apps/python/bindings/shared_tree.hpp"
#include "sim/scene/scene.hpp"
#include "sim/world/world.hpp"

namespace nbd::python {

/// A scene as Python gives it: a path, or a dictionary whose bodies may name objects instead of files.
struct GivenScene {
    SceneSpec spec;
    std::vector<LoadedBody> bodies;  // null pointers: from files
};

/// A world, with the scene that it was built from.
struct WorldObject {
    explicit WorldObject(GivenScene given)
        : scene(std::move(given.spec)),
          bodies(std::move(given.bodies)),
          world(build_world(scene, bodies, &moves)) {}

    operator Lockable&() { return *posing; }
    /// The body's number. Throws IndexError if it is out of range.
    int checked(int body) const {
        if (body < 0 || body >= world.body_count())
            throw py::index_error(fmt::format("body: is {}; allowed: 0..{}", body, world.body_count() - 1));
        return body;
    }
    /// The world, which is in use; poses that refer to it end.
    World& change() {
        ++posing->changes;
        return world;
    }

    SceneSpec scene;
    std::vector<LoadedBody> bodies;
    std::vector<StartMove> moves;  // of the scene's resolve_start
    World world;
    std::shared_ptr<PosingWorld> posing = std::make_shared<PosingWorld>();
};
using UsedWorld = Used<WorldObject>;

/// Adds what holds and presses bodies, and rules for pairs, to the class.
void bind_reactions(py::module_& m, py::class_<WorldObject>& world);

/// Adds what is told from step to step.
void bind_targets(py::class_<WorldObject>& world);

}  // namespace nbd::python
