#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>
#include <string>
#include <vector>

#include "apps/python/bindings/arrays.hpp"
#include "apps/python/bindings/world_object.hpp"

namespace nbd::python {
namespace {

using Three = Typed<"Sequence[float]">;

Keyframe place_from(const Three& translation, const Three& rotation, double scale) {
    return {.translation = vector_from(translation, "translation"),
            .rotation = vector_from(rotation, "rotation"),
            .scale = scale};
}

/// A joint or a part of a tendon, by its number or its name in the scene.
int joint_from(const WorldObject& self, const Typed<"Union[int, str]">& joint) {
    if (!py::isinstance<py::str>(joint)) return joint.cast<int>();
    const auto name = joint.cast<std::string>();
    const std::vector<SceneJoint>& all = self.scene.joints;
    const auto found =
        std::ranges::find_if(all, [&](const SceneJoint& one) { return one.joint.name == name; });
    if (found == all.end())
        throw std::invalid_argument(fmt::format("joint: \"{}\" is not in the scene", name));
    return static_cast<int>(found - all.begin());
}

}  // namespace

void bind_targets(py::class_<WorldObject>& world) {
    const auto translation = py::arg("translation") = py::make_tuple(0, 0, 0),
               rotation = py::arg("rotation") = py::make_tuple(0, 0, 0);
    const auto scale = py::arg("scale") = 1.0;
    const auto of_body = py::arg("body") = 0;
    world
        .def(
            "move_obstacle",
            [](const UsedWorld& self, int obstacle, const Three& translation, const Three& rotation,
               double scale) {
                self->world.move_obstacle(obstacle, place_from(translation, rotation, scale));
            },
            py::arg("obstacle"), translation, rotation, scale,
            "Moves an obstacle evenly in the next step to where this displaces it from its place in the scene: "
            "scaled, turned by rotation (axis times angle, radians; the shortest way) about the `centre` of its "
            "motion, then moved, metres. It stays there until the next call; its motion in the scene ends. "
            "Not a part of snapshots: after a restore, tell it again before each step.")
        .def(
            "move_grip",
            [](const UsedWorld& self, int grip, const Three& translation, const Three& rotation, double scale,
               int body) {
                self->world.move_grip(self->checked(body), grip, place_from(translation, rotation, scale));
            },
            py::arg("grip"), translation, rotation, scale, of_body,
            "Likewise a grip or pin of a body, by its number, pins first: from where it took its nodes.")
        .def(
            "set_joint",
            [](const UsedWorld& self, const Typed<"Union[int, str]">& joint, double value) {
                self->world.set_joint(joint_from(*self, joint), value);
            },
            py::arg("joint"), py::arg("value"),
            "Brings the motor of a hinge or slider, radians or metres, the winch of a rope or spring, metres, or the force of a part of a tendon, newtons, "
            "evenly to a value in the next step: of a joint that has one in the scene, by its number or name. It "
            "stays there until the next call, like a moved obstacle.")
        .def(
            "set_load",
            [](const UsedWorld& self, int load, double factor, int body) {
                self->world.set_load(self->checked(body), load, factor);
            },
            py::arg("load"), py::arg("factor"), of_body,
            "Likewise the factor of a load of a body, by its number, muscles after loads: of a muscle its "
            "activation, of a gas its amount.")
        .def(
            "set_wind",
            [](const UsedWorld& self, int load, const Three& velocity, int body) {
                self->world.set_wind(self->checked(body), load, vector_from(velocity, "velocity"));
            },
            py::arg("load"), py::arg("velocity"), of_body,
            "Likewise the velocity of the air, [3] m/s, of a load that is a wind.");
}

}  // namespace nbd::python
