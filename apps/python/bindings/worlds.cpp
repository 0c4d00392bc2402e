#include <fmt/format.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "apps/python/bindings/arrays.hpp"
#include "apps/python/bindings/bindings.hpp"
#include "apps/python/bindings/scene_argument.hpp"
#include "apps/python/bindings/shared_tree.hpp"
#include "collision/base/notice.hpp"
#include "sim/scene/body_warnings.hpp"
#include "sim/world/start_check.hpp"
#include "sim/world/world.hpp"

namespace nbd::python {
namespace {

/// A world, with the scene that it was built from.
struct WorldObject {
    WorldObject(SceneArgument argument, std::vector<LoadedBody> loaded)
        : scene(std::move(argument.spec)),
          bodies(std::move(loaded)),
          world(build_world(scene, bodies, &moves)) {}

    SceneSpec scene;
    std::vector<LoadedBody> bodies;
    std::vector<StartMove> moves;  // of the scene's resolve_start
    World world;
    std::shared_ptr<PosingWorld> posing = std::make_shared<PosingWorld>();
};

/// Marks a world as used while alive; poses that refer to it end.
class Change {
 public:
    explicit Change(WorldObject& object) : use_(object.posing->lock, "World") { ++object.posing->changes; }

 private:
    Use use_;
};

/// Warns of what may make the motion wrong.
void tell(const WorldObject& object) {
    const SceneSpec& scene = object.scene;
    if (const std::string line =
            start_warning(start_faults(object.world, body_labels(scene)), scene.resolve_start);
        !line.empty())
        notice(line);
    for (const std::string& line : scene_body_warnings(scene, object.bodies)) notice(line);
    for (const std::string& line : narrow_gap_warnings(scene, object.world)) notice(line);
}

std::unique_ptr<WorldObject> make_world(py::handle scene, const py::object& folder) {
    SceneArgument argument(scene, folder);
    return stoppable<FileCall>([&] {
        std::vector<LoadedBody> bodies = argument.load();
        auto object = std::make_unique<WorldObject>(std::move(argument), std::move(bodies));
        tell(*object);
        return object;
    });
}

/// The body's number. Throws IndexError if it is out of range.
int checked(const WorldObject& self, int body) {
    if (body < 0 || body >= self.world.body_count())
        throw py::index_error(fmt::format("body: is {}; allowed: 0..{}", body, self.world.body_count() - 1));
    return body;
}

/// Ctrl-C takes the step back. If no handler raises then, or another thread has to, the step begins again and
/// goes to its end.
WorldReport step(WorldObject& self, std::optional<double> dt) {
    const Change change(self);
    const double length = dt.value_or(self.scene.time.dt);
    const auto work = [&] { return self.world.step(length); };
    try {
        const Stoppable stop;
        return long_call(work);
    } catch (const StopAsked&) {
        if (PyErr_CheckSignals() != 0) throw py::error_already_set();
    }
    return long_call(work);
}

/// [(body, by), ...]
py::list as_list(const std::vector<StartMove>& moves) {
    py::list all;
    for (const StartMove& move : moves)
        all.append(py::make_tuple(move.body, owned(Eigen::Vector3d(move.by))));
    return all;
}

py::list resolve_start(WorldObject& self) {
    const Change change(self);
    return as_list(stoppable([&] { return self.world.resolve_start(); }));
}

void check_start(WorldObject& self) {
    const Use use(self.posing->lock, "World");
    long_call([&] { self.world.check_start(); });
}

/// A view of an array that the world keeps in place, and whose memory keeps the world alive.
template <class Get>
py::array world_view(py::object self, int body, bool writable, const Get& get) {
    auto& object = self.cast<WorldObject&>();
    return view(get(object.world, checked(object, body)), self, writable);
}

void bind_state(py::class_<WorldObject>& world) {
    world
        .def(
            "positions",
            [](py::object self, int body) {
                return world_view(self, body, false,
                                  [](World& w, int b) -> const Nodes& { return w.state(b).x; });
            },
            py::arg("body") = 0,
            "Positions of the tet nodes [N, 3], metres, counted from `origin`: a read-only view, which shows "
            "every step and keeps the world alive.")
        .def(
            "velocities",
            [](py::object self, int body) {
                return world_view(self, body, false,
                                  [](World& w, int b) -> const Nodes& { return w.state(b).v; });
            },
            py::arg("body") = 0, "Velocities of the tet nodes [N, 3], m/s: likewise a view.")
        .def(
            "forces",
            [](py::object self, int body) {
                return world_view(self, body, true,
                                  [](World& w, int b) -> const Nodes& { return w.forces(b); });
            },
            py::arg("body") = 0,
            "Outer forces on the tet nodes [N, 3], newtons: a view to write to. They act until changed.")
        .def(
            "contact_forces",
            [](py::object self, int body) {
                return world_view(self, body, false,
                                  [](World& w, int b) -> const Nodes& { return w.contact_forces(b); });
            },
            py::arg("body") = 0,
            "Mean contact forces on the tet nodes over the last step [N, 3], newtons: a view.")
        .def(
            "masses",
            [](py::object self, int body) {
                auto& object = self.cast<WorldObject&>();
                return view(object.world.elastic(checked(object, body)).node_masses(), self);
            },
            py::arg("body") = 0, "Masses of the tet nodes [N], kg: a view.")
        .def(
            "surface_positions",
            [](WorldObject& self, int body) {
                const Use use(self.posing->lock, "World");
                const World& w = self.world;
                return owned(embedded(w.surface(checked(self, body)).W(), w.state(body).x));
            },
            py::arg("body") = 0,
            "Positions of the surface's vertices [n, 3], metres, counted from `origin`: a new array.")
        .def(
            "drive",
            [](WorldObject& self, py::handle nodes, py::handle targets, int body) {
                const NodeRows rows(targets, "targets", 3);
                const Use use(self.posing->lock, "World");
                self.world.drive(checked(self, body), index_list(nodes, "nodes"), rows.as<Nodes>());
            },
            py::arg("nodes"), py::arg("targets"), py::arg("body") = 0,
            "Moves nodes to targets [nodes, 3], counted from `origin`, in the next step and holds them "
            "there until the next call, which replaces them. No nodes: frees all.");
}

void begin_pose_of_world(WorldObject& self, int body, PosedTreeObject& tree) {
    const CollisionTree& asked = tree.tree.tree();
    const ContactSurface& surface = self.world.surface(checked(self, body));
    if (asked.vertex_count != surface.vertex_count() || asked.faces != surface.F())
        throw std::invalid_argument("PosedTree: is of another surface than the body's");
    if (tree.tree.takes_nodes() && !asked.affine->hangs_by(surface.W().cast<float>()))
        throw std::invalid_argument("PosedTree: its affine bounds have other weights than the body");
    const Use use(self.posing->lock, "World"), use_tree(tree.lock, "PosedTree");
    tree.pose([&] { self.world.begin_pose(body, tree.tree); }, py::cast(&self));
    tree.world = self.posing;
    tree.world_changes = self.posing->changes;
}

void bind_queries_of_world(py::class_<WorldObject>& world) {
    world
        .def(
            "intersecting",
            [](WorldObject& self, int a, int b) {
                if (checked(self, a) == checked(self, b))
                    throw std::invalid_argument(
                        "a and b are one body; allowed: two, or intersecting_faces()");
                const Use use(self.posing->lock, "World");
                return pair_array(long_call([&] { return self.world.intersecting(a, b); }));
            },
            py::arg("a"), py::arg("b"), "Intersecting face pairs of two bodies now, found with their bounds.")
        .def(
            "intersecting_faces",
            [](WorldObject& self) {
                const Use use(self.posing->lock, "World");
                std::vector<std::tuple<int, int, int, int>> all;
                for (const Intersection& hit : long_call([&] { return self.world.intersecting_faces(); }))
                    all.emplace_back(hit.surface_a, hit.a, hit.surface_b, hit.b);
                return all;
            },
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
        std::visit(
            [&](auto member) {
                report.def_property_readonly(
                    number.name,
                    [member](const WorldReport& r) {
                        if constexpr (std::is_same_v<decltype(member), StepTrouble StepReport::*>)
                            return std::string(name(r.*member));
                        else
                            return r.*member;
                    },
                    number.text);
            },
            number.member);
    report.def_readonly("trouble_reason", &WorldReport::trouble_reason)
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
        .def("step", &step, py::arg("dt") = py::none(),
             "Advances by dt seconds, by default the scene's. Returns a report: look at `failure`. Raises "
             "ValueError for dt <= 0, and before the first step without intersections if surfaces intersect. "
             "Ctrl-C takes the step back, whose contact forces are zero then, and raises KeyboardInterrupt.")
        .def("check_start", &check_start,
             "Raises ValueError, naming the faces, where steps without intersections are asked for "
             "and surfaces intersect. The first step does it, too.")
        .def("resolve_start", &resolve_start,
             "Moves bodies without grips apart, and out of obstacles, until nothing intersects. "
             "Returns [(body, by), ...], the moves in metres. "
             "Raises ValueError, naming the faces, where that does not help.")
        .def_property_readonly(
            "start_moves", [](const WorldObject& self) { return as_list(self.moves); },
            "What the scene's `resolve_start` moved before the world began: [(body, by), ...], metres.")
        .def_property_readonly("time", [](const WorldObject& self) { return self.world.time(); })
        .def_property_readonly(
            "origin", [](const WorldObject& self) { return owned(Eigen::Vector3d(self.world.origin())); },
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
        .def(
            "snapshot",
            [](WorldObject& self) {
                const Use use(self.posing->lock, "World");
                return self.world.snapshot();
            },
            "The state now, without outer forces and driven nodes.")
        .def(
            "restore",
            [](WorldObject& self, const WorldSnapshot& snapshot) {
                const Change change(self);
                self.world.restore(snapshot);
            },
            py::arg("snapshot"), "Continues from a snapshot, with the same bits.")
        .def("__len__", [](const WorldObject& self) { return self.world.body_count(); });
    bind_state(world);
    bind_queries_of_world(world);
}

}  // namespace nbd::python
