#include <fmt/format.h>

#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "apps/python/bindings/arrays.hpp"
#include "apps/python/bindings/world_object.hpp"
#include "sim/scene/reaction_name.hpp"

namespace nbd::python {
namespace {

/// A reaction with the name of what exerts it.
struct NamedReaction : Reaction {
    std::string name;
};

std::vector<NamedReaction> reactions_of(const UsedWorld& self) {
    std::vector<NamedReaction> all;
    for (const Reaction& one : self->world.reactions()) all.push_back({one, reaction_name(self->scene, one)});
    return all;
}

void bind_reaction(py::module_& m) {
    py::class_<NamedReaction>(m, "Reaction", "A force on a body, a mean over a step.")
        .def_readonly("body", &NamedReaction::body, "The body that it acts on.")
        .def_property_readonly(
            "kind", [](const NamedReaction& self) { return std::string(name(self.by)); },
            "What exerts it: grip (pins among them), driven, obstacle, body, joint, cavity or wind.")
        .def_readonly(
            "number", &NamedReaction::number,
            "Of the grip among those of the body, pins first, of the cavity or load among those of the body, of the obstacle, of the other body, or of the joint.")
        .def_readonly("name", &NamedReaction::name, "Likewise, as the scene has it.")
        .def_property_readonly(
            "force", [](const NamedReaction& self) { return self.force; }, "[3] newtons.")
        .def_property_readonly(
            "torque", [](const NamedReaction& self) { return self.torque; },
            "[3] newton metres, about the origin of the scene's coordinates.")
        .def_property_readonly(
            "point", [](const NamedReaction& self) { return self.point; },
            "[3] metres: where it acts, the mean of the places of its forces, weighted with their sizes; zero "
            "of a cavity.")
        .def_readonly("pressure", &NamedReaction::pressure,
                      "Of a cavity, above the ambient one, pascals; 0 of others.")
        .def_readonly("volume", &NamedReaction::volume, "Of a cavity, cubic metres; 0 of others.")
        .def("__repr__", [](const NamedReaction& self) {
            return fmt::format("<nbdtree.Reaction: of {} on body {}, {:.4g} N>", self.name, self.body,
                               self.force.norm());
        });
}

void bind_cavity(py::module_& m) {
    py::class_<CavityState>(m, "Cavity", "The hollow within a closed part of a body's surface.")
        .def_readonly("body", &CavityState::body, "The body that has it.")
        .def_readonly("number", &CavityState::number, "Its number among those of the body.")
        .def_readonly("volume", &CavityState::volume, "Cubic metres.")
        .def_readonly("pressure", &CavityState::pressure,
                      "Of its loads and its gas, above the ambient pressure, pascals.")
        .def("__repr__", [](const CavityState& self) {
            return fmt::format("<nbdtree.Cavity: {} of body {}, {:.4g} m3, {:.4g} Pa>", self.number,
                               self.body, self.volume, self.pressure);
        });
}

void set_pair(const UsedWorld& self, int body, std::optional<int> other, std::optional<int> obstacle,
              bool meet, std::optional<double> friction) {
    if (other.has_value() == obstacle.has_value())
        throw std::invalid_argument("needs one of other and obstacle");
    if (obstacle && *obstacle < 0)
        throw std::invalid_argument(fmt::format("obstacle: is {}, but must be >= 0", *obstacle));
    self->change().set_pair(self->checked(body), other ? self->checked(*other) : party_of_obstacle(*obstacle),
                            {.meets = meet, .friction = friction});
}

}  // namespace

void bind_reactions(py::module_& m, py::class_<WorldObject>& world) {
    bind_reaction(m);
    bind_cavity(m);
    world
        .def(
            "reactions", &reactions_of,
            "What pins, grips, driven nodes, obstacles, joints, winds and other bodies exerted on bodies in the last step; "
            "of two bodies in contact, what acts on the first. What does not touch is left out. Weight, outer forces and reactions "
            "of a body, times the length of the step, sum to its change of momentum.")
        .def(
            "cavities", [](const UsedWorld& self) { return self->world.cavities(); },
            "The cavities of all bodies as they are now, by body and in the order of their faces.")
        .def(
            "joint_values",
            [](const UsedWorld& self) {
                std::vector<double> values;
                for (int j = 0; j < self->world.joint_count(); ++j)
                    values.push_back(self->world.joint_value(j));
                return values;
            },
            "Of each joint: the angle of a hinge, radians, the way of a slider or the length of a cord, metres; 0 of others.")
        .def(
            "broken_joints",
            [](const UsedWorld& self) {
                std::vector<bool> broken;
                for (int j = 0; j < self->world.joint_count(); ++j)
                    broken.push_back(self->world.is_broken(j));
                return broken;
            },
            "Of each joint: whether a force has torn it apart.")
        .def("set_pair", &set_pair, py::arg("body"), py::arg("other") = py::none(),
             py::arg("obstacle") = py::none(), py::arg("meet") = true, py::arg("friction") = py::none(),
             "Sets whether a body meets another body, itself or an obstacle, and with which friction; "
             "default: the usual. Raises ValueError for what is not there; the next step raises it where "
             "surfaces that meet from now on intersect.");
}

}  // namespace nbd::python
