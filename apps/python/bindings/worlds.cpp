#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <tuple>
#include <utility>
#include <variant>
#include <vector>

#include "apps/cli/load_body.hpp"
#include "apps/cli/output.hpp"
#include "apps/python/bindings/arrays.hpp"
#include "apps/python/bindings/bindings.hpp"
#include "apps/python/bindings/json_text.hpp"
#include "apps/python/bindings/long_call.hpp"
#include "apps/python/bindings/typed.hpp"
#include "apps/python/bindings/world_object.hpp"
#include "collision/base/notice.hpp"
#include "meshing/body/body.hpp"
#include "sim/scene/scene.hpp"
#include "sim/scene/scene_check.hpp"
#include "sim/world/start_check.hpp"
#include "sim/world/world.hpp"

namespace pybind11::detail {

template <>
struct type_caster<nbd::StepTrouble> {
    static constexpr auto name = const_name("str");

    static handle cast(nbd::StepTrouble trouble, return_value_policy, handle) {
        return str(nbd::name(trouble)).release();
    }
};

}  // namespace pybind11::detail

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

/// folder: of relative paths in a dictionary; None: the current one. Throws what load_scene() throws, and
/// std::invalid_argument for anything else.
GivenScene scene_from(py::handle scene, py::handle folder) {
    GivenScene given;
    if (!py::hasattr(scene, "keys")) {
        given.spec = load_scene(path_from(scene, "scene"));
        given.bodies.resize(given.spec.bodies.size());
        return given;
    }
    const auto copy = py::module_::import("copy").attr("copy");
    py::dict top;  // a copy: the caller's dictionary stays as it is
    top.attr("update")(scene);
    if (top.contains("bodies") && py::isinstance<py::sequence>(top["bodies"])) {
        py::list bodies;
        for (const py::handle body : top["bodies"]) {
            LoadedBody& loaded = given.bodies.emplace_back();
            py::object entry = copy(body);
            if (py::isinstance<py::dict>(entry)) {
                auto keys = py::reinterpret_borrow<py::dict>(entry);
                loaded.body = take<Body>(keys, "body");
                loaded.tree = take<CollisionTree>(keys, "tree");
                check_tree(loaded, given.bodies.size() - 1);
            }
            bodies.append(entry);
        }
        top["bodies"] = bodies;
    }
    given.spec = parse_scene(
        json_text(top), folder.is_none() ? std::filesystem::current_path() : path_from(folder, "folder"));
    given.bodies.resize(given.spec.bodies.size());
    return given;
}

/// Reads what is not given from files, and makes the trees.
void load_bodies(GivenScene& given) {
    Output silent;
    silent.quiet = true;
    SceneFiles files;
    files.load_recordings(given.spec);
    for (std::size_t b = 0; b < given.bodies.size(); ++b) {
        const SceneBody& body = given.spec.bodies[b];
        LoadedBody& loaded = given.bodies[b];
        if (!loaded.body) {
            loaded = files.load(body, silent);
        } else if (!loaded.tree && !body.tree.empty()) {
            TreeFile file = load_tree_of(body.name, body_hash(*loaded.body), body.tree);
            loaded.tree = std::make_shared<const CollisionTree>(std::move(file.tree));
        }
    }
    make_trees(given.spec, given.bodies);
}

/// Warns of what may make the motion wrong.
void tell(WorldObject& object) {
    const SceneSpec& scene = object.scene;
    if (const std::string line =
            start_warning(start_faults(object.world, body_labels(scene)), scene.resolve_start);
        !line.empty())
        notice(line);
    for (const std::string& line : scene_body_warnings(scene, object.bodies)) notice(line);
    for (const std::string& line : rest_warnings(scene, object.world)) notice(line);
}

std::unique_ptr<WorldObject> make_world(const Typed<"Union[Path, Mapping[str, Any]]">& scene,
                                        const Typed<"Optional[Path]">& folder) {
    GivenScene given = scene_from(scene, folder);
    const Stoppable stop;
    const FileCall call;
    load_bodies(given);
    auto object = std::make_unique<WorldObject>(std::move(given));
    tell(*object);
    return object;
}

/// Ctrl-C takes the step back. If no handler raises then, or another thread has to, the step begins again and
/// goes to its end.
WorldReport step(const UsedWorld& self, std::optional<double> dt) {
    World& world = self->change();
    const auto work = [&] { return world.step(dt.value_or(self->scene.time.dt)); };
    try {
        const Stoppable stop;
        return long_call(work);
    } catch (const StopAsked&) {
        if (PyErr_CheckSignals() != 0) throw py::error_already_set();
    }
    return long_call(work);
}

using Moves = std::vector<std::pair<int, Eigen::Vector3d>>;

/// [(body, by), ...]
Moves pairs_of(const std::vector<StartMove>& moves) {
    Moves all;
    for (const StartMove& move : moves) all.emplace_back(move.body, move.by);
    return all;
}

void bind_state(py::class_<WorldObject>& world) {
    const auto of_body = py::arg("body") = 0;
    constexpr auto refer = py::return_value_policy::reference_internal;
    world
        .def(
            "positions",
            [](const WorldObject& self, int body) -> const Nodes& {
                return self.world.state(self.checked(body)).x;
            },
            refer, of_body,
            "Positions of the tet nodes [N, 3], metres, counted from `origin`: a read-only view, which shows "
            "every step and keeps the world alive.")
        .def(
            "velocities",
            [](const WorldObject& self, int body) -> const Nodes& {
                return self.world.state(self.checked(body)).v;
            },
            refer, of_body, "Velocities of the tet nodes [N, 3], m/s: likewise a view.")
        .def(
            "forces",
            [](WorldObject& self, int body) -> Nodes& { return self.world.forces(self.checked(body)); },
            refer, of_body,
            "Outer forces on the tet nodes [N, 3], newtons: a view to write to. They act until changed.")
        .def(
            "contact_forces",
            [](const WorldObject& self, int body) -> const Nodes& {
                return self.world.contact_forces(self.checked(body));
            },
            refer, of_body,
            "Mean contact forces on the tet nodes over the last step [N, 3], newtons: a view.")
        .def(
            "masses",
            [](const WorldObject& self, int body) -> const Eigen::VectorXd& {
                return self.world.elastic(self.checked(body)).node_masses();
            },
            refer, of_body,
            "Masses of the tet nodes [N], kg: a view. Of quadratic tetrahedra the sums of the mass matrix's rows, "
            "right for momentum and weight, not for kinetic energy.")
        .def(
            "surface_positions",
            [](const UsedWorld& self, int body) { return self->world.surface(self->checked(body)); }, of_body,
            "Positions of the surface's vertices [n, 3], metres, counted from `origin`: a new array.")
        .def(
            "drive",
            [](const UsedWorld& self, const Typed<"Array">& nodes, const Rows<Nodes, "targets">& targets,
               int body) {
                self->world.drive(self->checked(body), list_from<std::int32_t>(nodes, "nodes"), *targets);
            },
            py::arg("nodes"), py::arg("targets"), of_body,
            "Moves nodes to targets [nodes, 3], counted from `origin`, in the next step and holds them "
            "there until the next call, which replaces them. No nodes: frees all.")
        .def(
            "snapshot", [](const UsedWorld& self) { return self->world.snapshot(); },
            "The state now, without outer forces, driven nodes and targets of obstacles, grips, joints and loads.")
        .def(
            "restore",
            [](const UsedWorld& self, const WorldSnapshot& snapshot) { self->change().restore(snapshot); },
            py::arg("snapshot"), "Continues from a snapshot, with the same bits.");
}

void begin_pose_of_world(const UsedWorld& self, int body, const Used<PosedTreeObject>& tree) {
    const CollisionTree& asked = tree->tree.tree();
    const ContactShape& shape = self->world.shape(self->checked(body));
    if (asked.vertex_count != shape.vertex_count() || asked.faces != shape.F)
        throw std::invalid_argument("PosedTree: is of another surface than the body's");
    if (tree->tree.takes_nodes() && !asked.affine->hangs_by(shape.W.cast<float>()))
        throw std::invalid_argument("PosedTree: its affine bounds have other weights than the body");
    tree->pose([&] { self->world.begin_pose(body, tree->tree); }, py::cast(&*self));
    tree->world = self->posing;
    tree->world_changes = self->posing->changes;
}

std::vector<FacePair> near_faces(const UsedWorld& self, int a, int b, std::optional<double> distance) {
    if (self->checked(a) == self->checked(b))
        throw std::invalid_argument("a and b are one body; allowed: two");
    return self->world.within(a, b, distance.value_or(self->world.thickness()));
}

std::vector<std::tuple<int, int, int, int>> faces_that_intersect(const UsedWorld& self) {
    std::vector<std::tuple<int, int, int, int>> all;
    for (const Intersection& hit : self->world.intersecting_faces())
        all.emplace_back(hit.surface_a, hit.a, hit.surface_b, hit.b);
    return all;
}

void bind_queries_of_world(py::class_<WorldObject>& world) {
    world
        .def(
            "within", &near_faces, py::arg("a"), py::arg("b"), py::arg("distance") = py::none(), Computes(),
            "Face pairs of two bodies at most `distance` metres apart now, found with their bounds; default: "
            "the distance at which contact begins.")
        .def("intersecting_faces", &faces_that_intersect, Computes(),
             "All faces that intersect, also within a body and with meshes of obstacles, by exact tests: "
             "(body or obstacle, face, body or obstacle, face).")
        .def("begin_pose", &begin_pose_of_world, py::arg("body"), py::arg("tree"),
             "Starts the pose of a tree over a body's surface. Refers to the world; "
             "valid until its next step, after which queries raise RuntimeError. "
             "Raises ValueError for a tree of another surface.");
}

void bind_report(py::module_& m) {
    py::class_<WorldReport> report(m, "WorldReport", "What a step did; SI units, costs in microseconds.");
    for (const StepNumber& number : step_numbers)
        std::visit([&](auto member) { report.def_readonly(number.name, member, number.text); },
                   number.member);
    report.def_readonly("trouble_reason", &WorldReport::trouble_reason)
        .def_readonly("imbalance", &WorldReport::imbalance,
                      "In a static scene: forces out of balance at the end of the increment, relative to "
                      "those on the body where they are largest; else 0.")
        .def_readonly("failure", &WorldReport::failure,
                      "Empty, or why the step failed; the world must not be stepped again.")
        .def("__repr__", [](const WorldReport& report) {
            return fmt::format("<nbdtree.WorldReport: {:.6g} s, {} contacts{}{}>", report.time,
                               report.contacts, report.failure.empty() ? "" : ", failed: ", report.failure);
        });
}

}  // namespace

void bind_worlds(py::module_& m) {
    bind_report(m);
    py::class_<WorldSnapshot>(m, "WorldSnapshot", "The state of a world, see World.restore().")
        .def_readonly("time", &WorldSnapshot::time);
    py::class_<WorldObject> world(m, "World", py::is_final(),
                                  "Deformable bodies and obstacles that move and touch each other.");
    world
        .def(py::init(&make_world), py::arg("scene"), py::arg("folder") = py::none(),
             "scene: the path of a scene file, or a dictionary with the same keys, whose bodies "
             "may name a Body under \"body\" and a CollisionTree under \"tree\" instead of files. "
             "folder: what relative paths of a dictionary start from; default: the current one. "
             "Warns (UserWarning) of bodies that overlap or touch something at the start, "
             "and of bodies whose size, tetrahedra or Poisson's ratio may make the motion wrong.")
        .def(
            "step", &step, py::arg("dt") = py::none(),
            "Advances by dt seconds, by default the scene's; in a static scene by a share dt of the load, to the "
            "next balance. Returns a report: look at `failure`. Raises "
            "ValueError for dt <= 0, and before the first step without intersections if surfaces intersect. "
            "Ctrl-C takes the step back, whose contact forces are zero then, and raises KeyboardInterrupt.")
        .def(
            "check_start", [](const UsedWorld& self) { self->world.check_start(); }, Computes(),
            "Raises ValueError, naming the faces, where steps without intersections are asked for "
            "and surfaces intersect. The first step does it, too.")
        .def(
            "resolve_start", [](const UsedWorld& self) { return pairs_of(self->change().resolve_start()); },
            ComputesLong(),
            "Moves bodies without grips apart, and out of obstacles, until nothing intersects. "
            "Returns [(body, by), ...], the moves in metres. "
            "Raises ValueError, naming the faces, where that does not help.")
        .def_property_readonly(
            "start_moves", [](const WorldObject& self) { return pairs_of(self.moves); },
            "What the scene's `resolve_start` moved before the world began: [(body, by), ...], metres.")
        .def_property_readonly("time", [](const WorldObject& self) { return self.world.time(); })
        .def_property_readonly(
            "origin", [](const WorldObject& self) { return Eigen::Vector3d(self.world.origin()); },
            "[3] metres: what all positions of the world are counted from; "
            "zero unless its bodies lie far away.")
        .def_property_readonly("dt", [](const WorldObject& self) { return self.scene.time.dt; })
        .def_property_readonly("frames", [](const WorldObject& self) { return self.scene.time.frames; })
        .def_property_readonly("steps_per_frame",
                               [](const WorldObject& self) { return self.scene.time.steps_per_frame; })
        .def_property_readonly("seed", [](const WorldObject& self) { return self.scene.seed; })
        .def_property_readonly(
            "scene", [](const WorldObject& self) { return self.scene.text; }, "The scene as JSON text.")
        .def_property_readonly(
            "thickness", [](const WorldObject& self) { return self.world.thickness(); },
            "Contact begins at this distance, metres.")
        .def_property_readonly("bodies",
                               [](const WorldObject& self) {
                                   std::vector<std::shared_ptr<Body>> all;
                                   for (const LoadedBody& body : self.bodies)
                                       all.push_back(std::const_pointer_cast<Body>(body.body));
                                   return all;
                               })
        .def_property_readonly("names",
                               [](const WorldObject& self) {
                                   std::vector<std::string> names;
                                   for (const SceneBody& body : self.scene.bodies) names.push_back(body.name);
                                   return names;
                               })
        .def("__len__", [](const WorldObject& self) { return self.world.body_count(); });
    bind_state(world);
    bind_queries_of_world(world);
    bind_reactions(m, world);
    bind_targets(world);
}

}  // namespace nbd::python
