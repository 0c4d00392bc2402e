#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "apps/cli/output_paths.hpp"
#include "apps/cli/remap_recording.hpp"
#include "apps/python/bindings/arrays.hpp"
#include "apps/python/bindings/bindings.hpp"
#include "apps/python/bindings/long_call.hpp"
#include "apps/python/bindings/typed.hpp"
#include "training/files/recording.hpp"
#include "training/files/recording_format.hpp"
#include "training/files/split.hpp"

namespace nbd::python {
namespace {

using std::filesystem::path;

struct ReaderObject : Lockable {
    explicit ReaderObject(const path& file) : Lockable("RecordingReader"), reader(file) {}

    /// The trajectory's place. Throws IndexError if there is none.
    int checked(int trajectory) const {
        const int count = reader.trajectories().size();
        if (trajectory < 0 || trajectory >= count)
            throw py::index_error(fmt::format("trajectory: is {}; allowed: 0..{}", trajectory, count - 1));
        return trajectory;
    }
    /// Number of frames from `begin` on that are asked for. Throws IndexError if there are not so many.
    int frame_count(int trajectory, int begin, std::optional<int> count) const {
        const int frames = reader.trajectories()[checked(trajectory)].frames;
        const int wanted = count.value_or(frames - begin);
        if (begin < 0 || wanted < 0 || begin > frames || wanted > frames - begin)
            throw py::index_error(
                fmt::format("frames: {} from {} on; the trajectory has {}", wanted, begin, frames));
        return wanted;
    }

    RecordingReader reader;
};
using Reader = Used<ReaderObject>;

std::unique_ptr<ReaderObject> open_recording(const path& file) {
    const FileCall call;
    return std::make_unique<ReaderObject>(file);
}

/// numpy takes over the rows, in another shape.
py::array_t<float> reshaped(Vertices rows, const std::vector<py::ssize_t>& shape) {
    return py::array(py::cast(std::move(rows))).reshape(shape);
}

/// [frames, nodes, 3]
py::array_t<float> read_frames(const Reader& self, int trajectory, int begin, std::optional<int> count) {
    const int wanted = self->frame_count(trajectory, begin, count);
    Vertices x;
    long_call<FileCall>([&] { self->reader.read(trajectory, begin, wanted, x); });
    return reshaped(std::move(x), {wanted, self->reader.nodes(trajectory), 3});
}

/// [frames, nodes, 3] or [frames, tets, 3, 3].
py::array_t<float> read_field(const Reader& self, int trajectory, const std::string& name, int begin,
                              std::optional<int> count) {
    const auto field = std::ranges::find(frame_fields, name, &FrameFieldName::name);
    if (field == frame_fields.end())
        throw std::invalid_argument(fmt::format(
            "field: is \"{}\"; allowed: contact_forces, first_piola_stress, deformation_gradients", name));
    const int wanted = self->frame_count(trajectory, begin, count);
    Vertices rows;
    long_call<FileCall>([&] { self->reader.read_field(trajectory, field->field, begin, wanted, rows); });
    if (field->of_tets)
        return reshaped(std::move(rows), {wanted, self->reader.contents(trajectory).tets, 3, 3});
    return reshaped(std::move(rows), {wanted, self->reader.nodes(trajectory), 3});
}

using EdgeRows = Eigen::Matrix<std::int32_t, Eigen::Dynamic, 3, Eigen::RowMajor>;

/// [edges, 3] rows, for each frame.
std::vector<EdgeRows> read_contact_edges(const Reader& self, int trajectory, int begin,
                                         std::optional<int> count) {
    const int wanted = self->frame_count(trajectory, begin, count);
    std::vector<EdgeRows> all;
    for (const std::vector<ContactEdge>& edges : self->reader.read_contact_edges(trajectory, begin, wanted)) {
        EdgeRows& rows = all.emplace_back(edges.size(), 3);
        Eigen::Index row = 0;
        for (const auto& [face, partner, other] : edges) rows.row(row++) << face, partner, other;
    }
    return all;
}

/// Names of what the frames of a trajectory hold besides positions.
std::vector<std::string> extras_of(const ReaderObject& self, int trajectory) {
    const FrameContents& contents = self.reader.contents(self.checked(trajectory));
    std::vector<std::string> names;
    for (const FrameFieldName& field : frame_fields)
        if (contents.fields[field.field]) names.emplace_back(field.name);
    if (contents.contact_edges) names.emplace_back(contact_edges_name);
    return names;
}

Typed<"RecordedReactions"> reactions_of_file(const Reader& self) {
    std::vector<RecordedReaction> rows;
    long_call<FileCall>([&] { rows = self->reader.reactions(); });
    py::dict columns;
    for (const ReactionColumn& column : reaction_columns)
        columns[column.name] = std::visit(
            [&]<class T>(ReactionColumn::Member<T> member) -> py::object {
                if constexpr (std::is_same_v<T, Eigen::Vector3d>) {
                    Nodes all(rows.size(), 3);
                    for (std::size_t i = 0; i < rows.size(); ++i) all.row(i) = rows[i].*member;
                    return py::cast(std::move(all));
                } else {
                    std::vector<T> all;
                    for (const RecordedReaction& row : rows) all.push_back(row.*member);
                    if constexpr (std::is_same_v<T, std::string>)
                        return py::cast(all);
                    else
                        return py::cast(nbd::python::column(all));
                }
            },
            column.value);
    return py::object(std::move(columns));
}

Typed<"dict[str, Indices]"> facts_of(const ReaderObject& self, int trajectory) {
    const FrameFacts& facts = self.reader.facts(self.checked(trajectory));
    py::dict all;
    for (const FrameFactName& fact : frame_facts)
        if (!(facts.*fact.list).empty()) all[fact.name] = column(facts.*fact.list);
    return all;
}

void bind_reader(py::module_& m) {
    py::class_<TrajectoryInfo>(m, "TrajectoryInfo", "Facts about one trajectory of a recording.")
        .def_readonly("id", &TrajectoryInfo::id)
        .def_readonly("seed", &TrajectoryInfo::seed)
        .def_readonly("body_hash", &TrajectoryInfo::body_hash)
        .def_property_readonly(
            "recipe", [](const TrajectoryInfo& t) { return t.recipe.str(); },
            "JSON text: the scene or excitation behind it.")
        .def_readonly("failure", &TrajectoryInfo::failure, "Empty, or why the run stopped early.")
        .def_readonly("frames", &TrajectoryInfo::frames);
    py::class_<ReaderObject>(m, "RecordingReader", py::is_final(),
                             "Reads frames of a recording or a dataset when they are asked for.")
        .def(py::init(&open_recording), py::arg("path"))
        .def_property_readonly("path", [](const ReaderObject& self) { return self.reader.path(); })
        .def_property_readonly(
            "origin", [](const ReaderObject& self) { return Eigen::Vector3d(self.reader.origin()); },
            "[3] metres: what positions are counted from; zero in most recordings.")
        .def_property_readonly(
            "trajectories", [](const ReaderObject& self) { return self.reader.trajectories(); },
            "Their facts, sorted by id. Includes failed ones.")
        .def_property_readonly(
            "frames", [](const ReaderObject& self) { return self.reader.frames(); },
            "How many frames all trajectories have together.")
        .def(
            "nodes", [](const ReaderObject& self, int i) { return self.reader.nodes(self.checked(i)); },
            py::arg("trajectory"), "Number of tet nodes of a trajectory.")
        .def("read", &read_frames, py::arg("trajectory"), py::arg("begin") = 0, py::arg("count") = py::none(),
             "Positions of the tet nodes, float32 [frames, nodes, 3], metres, counted from `origin`: "
             "a new array. trajectory: its place in `trajectories`.")
        .def("extras", &extras_of, py::arg("trajectory"),
             "Names of what its frames hold besides positions: contact_forces, first_piola_stress, "
             "deformation_gradients, contact_edges.")
        .def("read_field", &read_field, py::arg("trajectory"), py::arg("field"), py::arg("begin") = 0,
             py::arg("count") = py::none(),
             "contact_forces [frames, nodes, 3], newtons; first_piola_stress [frames, tets, 3, 3], Pa; or "
             "deformation_gradients, likewise: float32, a new array.")
        .def(
            "contact_edges", &read_contact_edges, py::arg("trajectory"), py::arg("begin") = 0,
            py::arg("count") = py::none(), UsesFiles(),
            "For each frame, rows (face, partner, other face) of what touches, int32 [edges, 3]. partner: id "
            "of a trajectory, its own for the body itself; -1 for a body that is not recorded; -2 - k for "
            "obstacle k, with other face -1.")
        .def(
            "reactions", &reactions_of_file,
            "What pins, grips, driven nodes, obstacles, joints, cavities and other bodies exerted on bodies "
            "in each step of a scene, as World.reactions() tells it: a dictionary with an array or list for "
            "each column, of as many rows. frame: that the step belongs to; time: of its end, seconds; body: "
            "id of the trajectory that it acts on; kind and by: of what exerts it, and its name; force, "
            "torque, point: [rows, 3]; pressure, volume: of cavities, else 0. No rows where nothing was "
            "recorded.")
        .def(
            "times", [](const Reader& self, int i) { return column(self->reader.times(self->checked(i))); },
            py::arg("trajectory"), UsesFiles(), "Seconds, one for each frame: a new array.")
        .def("facts", &facts_of, py::arg("trajectory"),
             "Counts of each frame, as far as they are known: contacts, troubled_steps, self_intersections.")
        .def(
            "label", [](const Reader& self, const std::string& name) { return self->reader.label(name); },
            py::arg("name"), UsesFiles(), "An attribute of the file; \"\" if it has none of this name.");
}

struct WriterObject : Lockable {
    WriterObject(const path& file, const Eigen::Vector3d& origin)
        : Lockable("RecordingWriter"), writer(std::make_unique<RecordingWriter>(file, origin)) {}

    std::vector<int>::iterator find(int handle) {
        const auto found = std::ranges::find(open, handle);
        if (found == open.end())
            throw std::invalid_argument(fmt::format("handle: {} is of no open trajectory", handle));
        return found;
    }
    RecordingWriter& get() const {
        if (!writer) throw std::runtime_error("RecordingWriter: is closed");
        return *writer;
    }

    std::unique_ptr<RecordingWriter> writer;  // null once it is finished or given up
    std::vector<int> open;                    // handles
};
using Writer = Used<WriterObject>;

std::unique_ptr<WriterObject> create_recording(const path& file,
                                               const Typed<"Optional[Sequence[float]]">& origin) {
    check_output(file, {});
    const Eigen::Vector3d from =
        origin.is_none() ? Eigen::Vector3d(Eigen::Vector3d::Zero()) : vector_from(origin, "origin");
    const FileCall call;
    return std::make_unique<WriterObject>(file, from);
}

int begin_trajectory(const Writer& self, int nodes, int id, const std::string& body_hash, std::uint64_t seed,
                     const std::string& recipe) {
    TrajectoryInfo info;
    info.id = id;
    info.seed = seed;
    info.body_hash = body_hash;
    info.recipe = recipe;
    self->open.push_back(self->get().begin_trajectory(info, nodes));
    return self->open.back();
}

void add_frame(const Writer& self, int handle, double time, const Rows<Vertices, "x">& x) {
    self->find(handle);
    self->get().add_frame(handle, time, *x);
}

void end_trajectory(const Writer& self, int handle, const std::string& failure,
                    const Typed<"Mapping[str, Array]">& facts) {
    FrameFacts lists;
    for (const auto& [key, value] : facts.cast<py::dict>()) {
        const auto name = py::str(key).cast<std::string>();
        const auto fact = std::ranges::find(frame_facts, name, &FrameFactName::name);
        if (fact == frame_facts.end())
            throw std::invalid_argument(fmt::format(
                "facts: \"{}\" is unknown; allowed: contacts, troubled_steps, self_intersections", name));
        lists.*fact->list = list_from<std::int32_t>(value, name.c_str());
    }
    const auto open = self->find(handle);
    const FileCall call;
    self->get().end_trajectory(handle, failure, lists);
    self->open.erase(open);
}

void label(const Writer& self, const std::string& name, const std::string& value) {
    check_line(name, "name");
    if (value.find('\0') != std::string::npos)
        throw std::invalid_argument("value: has a null character, which files cannot hold");
    self->get().label(name, value);
}

void close(WriterObject& self, bool finish) {
    RecordingWriter& writer = self.get();
    if (finish) writer.finish();
    self.writer.reset();
    self.open.clear();
}

void bind_writer(py::module_& m) {
    py::class_<WriterObject>(m, "RecordingWriter", py::is_final(),
                             "Writes a recording frame by frame. It has its name only after finish(); as a "
                             "context manager it finishes at the end, unless an exception passes.")
        .def(py::init(&create_recording), py::arg("path"), py::arg("origin") = py::none(),
             "origin: [3] metres, what positions are counted from; default: zero.")
        .def("begin_trajectory", &begin_trajectory, py::arg("nodes"), py::arg("id"),
             py::arg("body_hash") = "", py::arg("seed") = 0, py::arg("recipe") = "", UsesFiles(),
             "Opens a trajectory of so many tet nodes and returns its handle. Several may be open.")
        .def("add_frame", &add_frame, py::arg("handle"), py::arg("time"), py::arg("x"), UsesFiles(),
             "x: positions [nodes, 3], metres, counted from the origin, stored as float32. time: seconds, "
             "later than before.")
        .def("end_trajectory", &end_trajectory, py::arg("handle"), py::arg("failure") = "",
             py::arg("facts") = py::dict(), "facts: lists of counts, one for each frame, by their names.")
        .def("label", &label, py::arg("name"), py::arg("value"), UsesFiles(),
             "Adds an attribute of the whole file.")
        .def(
            "finish", [](const Writer& self) { close(*self, true); }, UsesFiles(),
            "Ends open trajectories and gives the file its name.")
        .def(
            "abandon", [](const Writer& self) { close(*self, false); }, UsesFiles(),
            "Removes what was written.")
        .def("__enter__",
             [](Typed<"RecordingWriter"> self) {
                 self.cast<const WriterObject&>().get();
                 return self;
             })
        .def(
            "__exit__",
            [](const Writer& self, const Typed<"Any">& type, const Typed<"Any">&, const Typed<"Any">&) {
                const bool finish = type.is_none();
                const FileCall call;
                if (self->writer) close(*self, finish);
            },
            py::arg("type"), py::arg("value"), py::arg("traceback"));
}

int remap(const path& recording, const path& output, const Body& source, const Body& target,
          int trajectories) {
    if (trajectories < 0)
        throw std::invalid_argument(
            fmt::format("trajectories: is {}; allowed: 0 or more, 0 for all", trajectories));
    check_output(output.string(), {recording.string()});
    return remap_recording(recording, source, target, output, trajectories).frames;
}

}  // namespace

void bind_recordings(py::module_& m) {
    bind_reader(m);
    bind_writer(m);
    m.def("remap", &remap, py::arg("recording"), py::arg("path"), py::arg("source"), py::arg("target"),
          py::arg("trajectories") = 0, UsesFilesLong(),
          "Writes a recording of the body `source` as one of `target`, "
          "which has the same tetrahedra and another surface, as `nbdtree remap`. "
          "trajectories: at most so many, from the first; 0: all. Returns the number of frames. "
          "Raises RuntimeError where the bodies or the recording do not fit; nothing is written then.");
}

}  // namespace nbd::python
