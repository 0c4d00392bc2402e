#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <concepts>
#include <functional>
#include <limits>
#include <memory>
#include <span>
#include <stdexcept>
#include <tuple>
#include <utility>
#include <vector>

#include "apps/python/bindings/arrays.hpp"
#include "apps/python/bindings/bindings.hpp"
#include "apps/python/bindings/long_call.hpp"
#include "apps/python/bindings/shared_tree.hpp"
#include "apps/python/bindings/typed.hpp"
#include "collision/query/closest_query.hpp"
#include "collision/query/many_body_query.hpp"
#include "collision/query/one_shot.hpp"
#include "collision/query/pair_query.hpp"
#include "collision/query/self_query.hpp"

namespace pybind11::detail {

template <>
struct type_caster<nbd::ClosestFaces> {
    static constexpr auto name = const_name("ClosestFaces");

    static handle cast(const nbd::ClosestFaces& found, return_value_policy, handle) {
        return dict(arg("faces") = make_tuple(found.faces.a, found.faces.b), arg("a") = found.points.a,
                    arg("b") = found.points.b, arg("distance") = found.points.distance)
            .release();
    }
};

}  // namespace pybind11::detail

namespace nbd::python {
namespace {

using Posed = PosedTreeObject;

float checked_distance(double distance) {
    if (!(distance >= 0) || !(distance <= std::numeric_limits<float>::max()))
        throw std::invalid_argument(
            fmt::format("distance: is {}; allowed: metres, finite, at least 0", distance));
    return distance;
}

/// A query with its scratch memory.
template <class Query>
struct QueryObject : Lockable {
    template <class... Arguments>
    requires std::constructible_from<Query, Arguments...>
    explicit QueryObject(Arguments&&... arguments)
        : Lockable("query"), query(std::forward<Arguments>(arguments)...) {}

    Query query;
};

/// The answer of a query, which is in use, about posed trees that no other thread uses meanwhile.
template <class Ask>
auto answer(const std::vector<Posed*>& trees, const Ask& ask) {
    const UsePoses poses(trees);
    return long_call(ask);
}

/// Likewise about two trees.
template <class Ask>
auto answer(Posed& a, Posed& b, const Ask& ask) {
    if (&a == &b)
        throw std::invalid_argument("a and b are one PosedTree; allowed: two, or a SelfQuery of one");
    return answer({&a, &b}, ask);
}

Typed<"dict[str, int]"> counters_of(const QueryObject<PairQuery>& self) {
    const QueryCounters& counters = self.query.counters();
    return py::dict(
        py::arg("nodes_bounded") = counters.nodes_bounded,
        py::arg("nodes_out_of_range") = counters.nodes_out_of_range,
        py::arg("node_tests") = counters.node_tests, py::arg("leaf_pairs") = counters.leaf_pairs,
        py::arg("boxes_refitted") = counters.boxes_refitted, py::arg("box_tests") = counters.box_tests,
        py::arg("triangle_tests") = counters.triangle_tests, py::arg("face_pairs") = counters.face_pairs);
}

void bind_pair_query(py::module_& m) {
    using Pairs = Used<QueryObject<PairQuery>>;
    py::class_<QueryObject<PairQuery>>(
        m, "PairQuery", py::is_final(),
        "Queries between two posed trees. Owns scratch memory: keep one for all "
        "frames. Answers are new arrays [pairs, 2] of rows of the two face arrays.")
        .def(py::init<>())
        .def(
            "intersecting",
            [](const Pairs& self, Posed& a, Posed& b) {
                return answer(a, b, [&] { return self->query.intersecting(a.tree, b.tree); });
            },
            py::arg("a"), py::arg("b"),
            "Face pairs that have a point in common, sorted; learned bounds give a subset.")
        .def(
            "within",
            [](const Pairs& self, Posed& a, Posed& b, double distance) {
                const float d = checked_distance(distance);
                return answer(a, b, [&] { return self->query.within(a.tree, b.tree, d); });
            },
            py::arg("a"), py::arg("b"), py::arg("distance"),
            "Face pairs at most `distance` apart (metres), sorted.")
        .def(
            "boxes_within",
            [](const Pairs& self, Posed& a, Posed& b, double distance) {
                const float d = checked_distance(distance);
                return answer(a, b, [&] { return self->query.boxes_within(a.tree, b.tree, d); });
            },
            py::arg("a"), py::arg("b"), py::arg("distance"),
            "All of within() and some more pairs of faces whose boxes come within `distance`, in no order.")
        .def_property_readonly("counters", &counters_of, "Counters of the last query.");
}

void bind_self_query(py::module_& m) {
    py::class_<FacePairSet, std::shared_ptr<FacePairSet>>(m, "FacePairSet", "Pairs of faces of one surface.")
        .def("__len__", &FacePairSet::size)
        .def(
            "__contains__",
            [](const FacePairSet& set, std::pair<int, int> pair) {
                const auto in_range = [&](int face) { return face >= 0 && face < set.face_count(); };
                return in_range(pair.first) && in_range(pair.second) && set.contains(pair.first, pair.second);
            },
            py::arg("pair"));
    m.def(
        "near_at_rest",
        [](const Rows<Vertices, "X">& X, const Rows<Faces, "F">& F, double distance) {
            return std::const_pointer_cast<FacePairSet>(near_at_rest(*X, *F, checked_distance(distance)));
        },
        py::arg("X"), py::arg("F"), py::arg("distance"), Computes(),
        "The pairs of faces that are at most `distance` apart at rest, for SelfQuery to leave out.");
    using Self = Used<QueryObject<SelfQuery>>;
    py::class_<QueryObject<SelfQuery>>(
        m, "SelfQuery", py::is_final(),
        "Queries of a posed tree with itself. Leaves out faces that share a vertex.")
        .def(py::init<std::shared_ptr<FacePairSet>>(), py::arg("left_out") = py::none(),
             "left_out: further pairs to leave out.")
        .def(
            "intersecting",
            [](const Self& self, Posed& body) {
                return answer({&body}, [&] { return self->query.intersecting(body.tree); });
            },
            py::arg("body"), "Pairs (a, b), a < b, of faces with a common point, sorted.")
        .def(
            "within",
            [](const Self& self, Posed& body, double distance) {
                const float d = checked_distance(distance);
                return answer({&body}, [&] { return self->query.within(body.tree, d); });
            },
            py::arg("body"), py::arg("distance"), "Likewise pairs at most `distance` apart (metres).");
}

void bind_closest_query(py::module_& m) {
    py::class_<QueryObject<ClosestQuery>>(m, "ClosestQuery", py::is_final(),
                                          "Distances between two posed trees.")
        .def(py::init<>())
        .def(
            "closest",
            [](const Used<QueryObject<ClosestQuery>>& self, Posed& a, Posed& b, double most) {
                if (!(most >= 0))
                    throw std::invalid_argument(fmt::format("most: is {}; allowed: at least 0", most));
                return answer(a, b, [&] { return self->query.closest(a.tree, b.tree, most); });
            },
            py::arg("a"), py::arg("b"), py::arg("most") = std::numeric_limits<double>::infinity(),
            "The closest faces and points, {faces, a, b, distance}; "
            "None if further apart than `most` metres.");
}

/// (a, b, pairs) of bodies that touch.
using Touching = std::tuple<int, int, std::span<const FacePair>>;

/// What ask() finds among the trees of bodies.
template <class Ask>
std::vector<Touching> touching(const std::vector<Posed*>& bodies, const Ask& ask) {
    const std::vector<py::object> kept = keep(bodies, "PosedTree");
    std::vector<PosedTree*> trees;
    for (Posed* body : bodies) trees.push_back(&body->tree);
    std::vector<Touching> all;
    for (const TouchingBodies& pair : answer(bodies, [&] { return ask(trees); }))
        all.emplace_back(pair.bodies.a, pair.bodies.b, pair.faces);
    return all;
}

void bind_many_body_query(py::module_& m) {
    using Many = Used<QueryObject<ManyBodyQuery>>;
    py::class_<QueryObject<ManyBodyQuery>>(
        m, "ManyBodyQuery", py::is_final(),
        "Queries between all bodies of a list. Answers are lists of (a, b, pairs), a < "
        "b, of bodies that touch.")
        .def(py::init([] {
            return std::make_unique<QueryObject<ManyBodyQuery>>(
                [](int count, const std::function<void(int)>& task) { tbb::parallel_for(0, count, task); });
        }))
        .def(
            "intersecting",
            [](const Many& self, const std::vector<Posed*>& bodies) {
                return touching(bodies, [&](const auto& trees) { return self->query.intersecting(trees); });
            },
            py::arg("bodies"), "As PairQuery.intersecting() of all pairs.")
        .def(
            "within",
            [](const Many& self, const std::vector<Posed*>& bodies, double distance) {
                const float d = checked_distance(distance);
                return touching(bodies, [&](const auto& trees) { return self->query.within(trees, d); });
            },
            py::arg("bodies"), py::arg("distance"), "As PairQuery.within() of all pairs.");
}

// Two surfaces as arrays.
using Xa = Rows<Nodes, "xa">;
using Xb = Rows<Nodes, "xb">;
using Fa = Rows<Faces, "fa">;
using Fb = Rows<Faces, "fb">;

void bind_one_shot(py::module_& m) {
    m.def(
        "intersecting_faces",
        [](const Xa& xa, const Fa& fa, const Xb& xb, const Fb& fb) {
            return intersecting_faces(*xa, *fa, *xb, *fb);
        },
        py::arg("xa"), py::arg("fa"), py::arg("xb"), py::arg("fb"), Computes(),
        "Pairs of faces of two surfaces that have a point in common, [pairs, 2]. Positions become "
        "float32 counted from a common origin, so that they may lie far from zero. For surfaces that move, "
        "keep a PosedTree for each and a PairQuery.");
    m.def(
        "face_pairs_within",
        [](const Xa& xa, const Fa& fa, const Xb& xb, const Fb& fb, double distance) {
            return face_pairs_within(*xa, *fa, *xb, *fb, checked_distance(distance));
        },
        py::arg("xa"), py::arg("fa"), py::arg("xb"), py::arg("fb"), py::arg("distance"), Computes(),
        "Likewise pairs at most `distance` apart (metres).");
    m.def(
        "closest_points",
        [](const Xa& xa, const Fa& fa, const Xb& xb, const Fb& fb) {
            return closest_points(*xa, *fa, *xb, *fb);
        },
        py::arg("xa"), py::arg("fa"), py::arg("xb"), py::arg("fb"), Computes(),
        "The closest faces of two surfaces and their closest points, as ClosestQuery.closest().");
}

}  // namespace

void bind_queries(py::module_& m) {
    bind_pair_query(m);
    bind_self_query(m);
    bind_closest_query(m);
    bind_many_body_query(m);
    bind_one_shot(m);
}

}  // namespace nbd::python
