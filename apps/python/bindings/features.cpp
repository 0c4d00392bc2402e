#include <fmt/format.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <array>
#include <deque>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "apps/python/bindings/arrays.hpp"
#include "apps/python/bindings/bindings.hpp"
#include "apps/python/bindings/long_call.hpp"
#include "collision/continuous/feature_query.hpp"

namespace nbd::python {
namespace {

/// A moving body. Its faces and edges are copies, so that they can be read while a query has the body.
struct MovingBodyObject {
    explicit MovingBodyObject(MovingBody made)
        : body(std::move(made)), F(body.F()), edges(body.features().edges) {}

    MovingBody body;
    Faces F;
    SurfaceFeatures::Pairs edges;
    Lockable lock;
};

BodyRole role_named(const std::string& name) {
    if (name == "body") return BodyRole::body;
    if (name == "obstacle") return BodyRole::obstacle;
    throw std::invalid_argument(fmt::format("role: is \"{}\"; allowed: body, obstacle", name));
}

MovingBody moving_body(py::handle X, py::handle F, const std::string& role) {
    const NodeRows vertices(X, "X", 3);
    const IndexRows faces(F, "F", 3);
    const BodyRole as = role_named(role);
    const LongCall call;
    return {vertices.as<Nodes>(), faces.as<Faces>(), as};
}

void move(MovingBodyObject& self, py::handle begin, py::handle end) {
    const NodeRows from(begin, "begin", 3), to(end, "end", 3);
    const Use use(self.lock, "MovingBody");
    const LongCall call;
    self.body.move(from.as<Nodes>(), to.as<Nodes>());
}

py::array positions(MovingBodyObject& self, double share) {
    if (!(share >= 0 && share <= 1))
        throw std::invalid_argument(fmt::format("share: is {}; allowed: 0 to 1", share));
    const Use use(self.lock, "MovingBody");
    return owned(self.body.at(share));
}

struct FeatureQueryObject {
    FeatureQuery query;
    Lockable lock;
};

/// The bodies of a list in a row, as the library takes them, while no other thread uses one of them.
class InARow {
 public:
    explicit InARow(const std::vector<MovingBodyObject*>& objects) : objects_(objects) {
        if (const auto none = std::ranges::find(objects, nullptr); none != objects.end())
            throw std::invalid_argument(
                fmt::format("bodies[{}]: is None; allowed: a MovingBody", none - objects.begin()));
        std::vector<MovingBodyObject*> sorted = objects;
        std::ranges::sort(sorted);
        if (std::ranges::adjacent_find(sorted) != sorted.end())
            throw std::invalid_argument("bodies: one MovingBody is there twice");
        for (MovingBodyObject* object : objects) {
            held_.push_back(py::cast(object, py::return_value_policy::reference));
            uses_.emplace_back(object->lock, "MovingBody");
        }
        bodies_.reserve(objects.size());
        for (MovingBodyObject* object : objects) bodies_.push_back(std::move(object->body));
    }
    ~InARow() {
        for (std::size_t i = 0; i < bodies_.size(); ++i) objects_[i]->body = std::move(bodies_[i]);
    }
    InARow(const InARow&) = delete;
    InARow& operator=(const InARow&) = delete;

    std::span<MovingBody> bodies() noexcept { return bodies_; }

 private:
    std::vector<MovingBodyObject*> objects_;
    std::vector<py::object> held_;  // another thread may empty the list
    std::deque<Use> uses_;
    std::vector<MovingBody> bodies_;
};

template <class Ask>
auto answer(FeatureQueryObject& self, const std::vector<MovingBodyObject*>& objects, const Ask& ask) {
    const Use use(self.lock, "query");
    InARow row(objects);
    const LongCall call;
    return ask(self.query, row.bodies());
}

const char* name(FeatureKind kind) noexcept {
    return kind == FeatureKind::vertex_face ? "vertex_face" : "edge_edge";
}

using FeatureRows = Eigen::Matrix<int, Eigen::Dynamic, 4, Eigen::RowMajor>;

/// Rows (surface_a, surface_b, a, b) of the pairs of one kind.
FeatureRows rows_of(std::span<const FeaturePair> pairs, FeatureKind kind) {
    const auto is_of_kind = [kind](const FeaturePair& pair) { return pair.kind == kind; };
    FeatureRows rows(std::ranges::count_if(pairs, is_of_kind), 4);
    Eigen::Index row = 0;
    for (const FeaturePair& pair : pairs)
        if (is_of_kind(pair)) rows.row(row++) << pair.surface_a, pair.surface_b, pair.a, pair.b;
    return rows;
}

py::dict candidates(FeatureQueryObject& self, const std::vector<MovingBodyObject*>& bodies, double distance) {
    std::array<FeatureRows, 2> found =
        answer(self, bodies, [distance](FeatureQuery& query, std::span<MovingBody> row) {
            const auto pairs = query.candidates(row, distance);
            return std::array{rows_of(pairs, FeatureKind::vertex_face),
                              rows_of(pairs, FeatureKind::edge_edge)};
        });
    py::dict all;
    all[name(FeatureKind::vertex_face)] = owned(std::move(found[0]));
    all[name(FeatureKind::edge_edge)] = owned(std::move(found[1]));
    return all;
}

py::dict free_step(FeatureQueryObject& self, const std::vector<MovingBodyObject*>& bodies, double separation,
                   double left) {
    const FreeStep step =
        answer(self, bodies, [separation, left](FeatureQuery& query, std::span<MovingBody> row) {
            return query.collision_free_step(row, separation, left);
        });
    py::object limit = py::none();
    if (step.limit) {
        const FeaturePair& pair = *step.limit;
        limit = py::make_tuple(name(pair.kind), pair.surface_a, pair.surface_b, pair.a, pair.b);
    }
    py::dict all;
    all["share"] = step.share;
    all["limit"] = limit;
    all["gap"] = step.gap;
    all["exhausted"] = step.exhausted;
    return all;
}

}  // namespace

void bind_features(py::module_& m) {
    py::class_<MovingBodyObject>(m, "MovingBody", py::is_final(),
                                 "A surface whose vertices move straight from one pose to another, or stay "
                                 "in a pose, for FeatureQuery. It may be open, in any unit of length.")
        .def(py::init([](py::handle X, py::handle F, const std::string& role) {
                 return std::make_unique<MovingBodyObject>(moving_body(X, F, role));
             }),
             py::arg("X"), py::arg("F"), py::arg("role") = "body",
             "X: positions in any pose, [n, 3], float64, where the body is until move(). F: faces [m, 3]. "
             "role: body, which meets others and itself; obstacle, which meets bodies alone. Copied.")
        .def("move", &move, py::arg("begin"), py::arg("end"),
             "Starts a step from one pose to another, [n, 3]; copied.")
        .def(
            "pose", [](MovingBodyObject& self, py::handle x) { move(self, x, x); }, py::arg("x"),
            "The body stays here; copied.")
        .def("at", &positions, py::arg("share"), "Positions after a share of the step, [n, 3].")
        .def_property_readonly(
            "F", [](py::object self) { return view(self.cast<const MovingBodyObject&>().F, self); },
            "Faces [m, 3], int32. Refers to the body.")
        .def_property_readonly(
            "edges", [](py::object self) { return view(self.cast<const MovingBodyObject&>().edges, self); },
            "Edges, each once, [e, 2] vertices, int32: pairs of edges name their rows. Refers to the body.");
    py::class_<FeatureQueryObject>(
        m, "FeatureQuery", py::is_final(),
        "Which vertices, faces and edges of MovingBody objects may meet in a step, in double precision, and "
        "how much of the step is free. Owns scratch memory: keep one for all steps. Surfaces are numbered "
        "as they stand in the list of bodies.")
        .def(py::init<>())
        .def("candidates", &candidates, py::arg("bodies"), py::arg("distance"),
             "Pairs without a common vertex whose boxes over the step come within `distance`, each once, "
             "sorted; none that does so itself is left out. {vertex_face, edge_edge}: rows (surface_a, "
             "surface_b, a, b); a and b are a vertex and a face, or two rows of the bodies' `edges`.")
        .def(
            "collision_free_step", &free_step, py::arg("bodies"), py::arg("separation"),
            py::arg("left") = 0.1,
            "{share, limit, gap, exhausted}. Up to `share` of the step all of these pairs stay farther apart "
            "than `separation`; those that would come nearer later keep the share `left` of their gap. "
            "limit: (kind, surface_a, surface_b, a, b) of the pair that ends the step, or None; gap: its "
            "distance at the begin; exhausted: the search for it gave up, so that it may pass.");
}

}  // namespace nbd::python
