#include <fmt/format.h>

#include <algorithm>
#include <deque>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "apps/python/bindings/arrays.hpp"
#include "apps/python/bindings/bindings.hpp"
#include "apps/python/bindings/long_call.hpp"
#include "apps/python/bindings/typed.hpp"
#include "collision/continuous/feature_query.hpp"

namespace nbd::python {
namespace {

/// A moving body. Its faces and edges are copies, so that they can be read while a query has the body.
struct MovingBodyObject : Lockable {
    explicit MovingBodyObject(MovingBody made)
        : Lockable("MovingBody"), body(std::move(made)), F(body.F()), edges(body.features().edges) {}

    MovingBody body;
    Faces F;
    SurfaceFeatures::Pairs edges;
};

std::unique_ptr<MovingBodyObject> moving_body(const Rows<Nodes, "X">& X, const Rows<Faces, "F">& F,
                                              const std::string& name) {
    constexpr std::pair<const char*, BodyRole> roles[] = {{"body", BodyRole::body},
                                                          {"obstacle", BodyRole::obstacle}};
    const BodyRole role = value_named<BodyRole>("role", name, roles);
    const LongCall call;
    return std::make_unique<MovingBodyObject>(MovingBody(*X, *F, role));
}

void move(const Used<MovingBodyObject>& self, const Rows<Nodes, "begin">& begin,
          const Rows<Nodes, "end">& end) {
    self->body.move(*begin, *end);
}

void stay(const Used<MovingBodyObject>& self, const Rows<Nodes, "x">& x) { self->body.pose(*x); }

Nodes positions(const Used<MovingBodyObject>& self, double share) {
    if (!(share >= 0 && share <= 1))
        throw std::invalid_argument(fmt::format("share: is {}; allowed: 0 to 1", share));
    return self->body.at(share);
}

struct FeatureQueryObject : Lockable {
    FeatureQueryObject() : Lockable("query") {}
    FeatureQuery query;
};

/// The bodies of a list in a row, as the library takes them, while no other thread uses one of them.
class InARow {
 public:
    explicit InARow(const std::vector<MovingBodyObject*>& objects)
        : objects_(objects), kept_(keep(objects, "MovingBody")) {
        for (MovingBodyObject* object : objects) uses_.emplace_back(*object);
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
    std::vector<py::object> kept_;
    std::deque<Use> uses_;
    std::vector<MovingBody> bodies_;
};

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

Typed<"FeaturePairs"> candidates(const Used<FeatureQueryObject>& self,
                                 const std::vector<MovingBodyObject*>& bodies, double distance) {
    InARow row(bodies);
    auto [vertex_face, edge_edge] = long_call([&] {
        const auto pairs = self->query.candidates(row.bodies(), distance);
        return std::pair(rows_of(pairs, FeatureKind::vertex_face), rows_of(pairs, FeatureKind::edge_edge));
    });
    return py::dict(py::arg("vertex_face") = std::move(vertex_face),
                    py::arg("edge_edge") = std::move(edge_edge));
}

Typed<"FreeStep"> free_step(const Used<FeatureQueryObject>& self,
                            const std::vector<MovingBodyObject*>& bodies, double separation, double left) {
    InARow row(bodies);
    const FreeStep step =
        long_call([&] { return self->query.collision_free_step(row.bodies(), separation, left); });
    py::object limit = py::none();
    if (step.limit) {
        const FeaturePair& pair = *step.limit;
        limit = py::make_tuple(name(pair.kind), pair.surface_a, pair.surface_b, pair.a, pair.b);
    }
    return py::dict(py::arg("share") = step.share, py::arg("limit") = limit, py::arg("gap") = step.gap,
                    py::arg("exhausted") = step.exhausted);
}

}  // namespace

void bind_features(py::module_& m) {
    py::class_<MovingBodyObject>(m, "MovingBody", py::is_final(),
                                 "A surface whose vertices move straight from one pose to another, or stay "
                                 "in a pose, for FeatureQuery. It may be open, in any unit of length.")
        .def(py::init(&moving_body), py::arg("X"), py::arg("F"), py::arg("role") = "body",
             "X: positions in any pose, [n, 3], float64, where the body is until move(). F: faces [m, 3]. "
             "role: body, which meets others and itself; obstacle, which meets bodies alone. Copied.")
        .def("move", &move, py::arg("begin"), py::arg("end"), Computes(),
             "Starts a step from one pose to another, [n, 3]; copied.")
        .def("pose", &stay, py::arg("x"), Computes(), "The body stays here; copied.")
        .def("at", &positions, py::arg("share"), "Positions after a share of the step, [n, 3].")
        .def_readonly("F", &MovingBodyObject::F, "Faces [m, 3], int32. Refers to the body.")
        .def_readonly(
            "edges", &MovingBodyObject::edges,
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
