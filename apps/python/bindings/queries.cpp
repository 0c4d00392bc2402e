#include <fmt/format.h>
#include <pybind11/stl.h>
#include <tbb/parallel_for.h>

#include <cmath>
#include <limits>

#include "apps/python/bindings/bindings.hpp"
#include "apps/python/bindings/shared_tree.hpp"
#include "collision/query/closest_query.hpp"
#include "collision/query/many_body_query.hpp"
#include "collision/query/one_shot.hpp"
#include "collision/query/pair_query.hpp"
#include "collision/query/self_query.hpp"

namespace nbd::python {
namespace {

using Posed = PosedTreeObject;

float checked_distance(double distance) {
    if (!(distance >= 0) || !(distance <= std::numeric_limits<float>::max()))
        throw std::invalid_argument(
            fmt::format("distance: is {}; allowed: metres, finite, at least 0", distance));
    return static_cast<float>(distance);
}

/// A query with its scratch memory.
template <class Query>
struct QueryObject {
    Query query;
    Lockable lock;
};

/// The answer of a query about two trees, while no other thread uses any of the three.
template <class Query, class Ask>
auto answer(QueryObject<Query>& self, Posed& a, Posed& b, const Ask& ask) {
    if (&a == &b)
        throw std::invalid_argument("a and b are one PosedTree; allowed: two, or a SelfQuery of one");
    const Use use(self.lock, "query");
    PosedTreeObject* const both[] = {&a, &b};
    const UsePoses poses(both);
    const LongCall call;
    return ask(self.query, a.tree, b.tree);
}

py::dict counters_of(const QueryCounters& counters) {
    py::dict all;
    all["nodes_bounded"] = counters.nodes_bounded;
    all["nodes_out_of_range"] = counters.nodes_out_of_range;
    all["node_tests"] = counters.node_tests;
    all["leaf_pairs"] = counters.leaf_pairs;
    all["boxes_refitted"] = counters.boxes_refitted;
    all["box_tests"] = counters.box_tests;
    all["triangle_tests"] = counters.triangle_tests;
    all["face_pairs"] = counters.face_pairs;
    return all;
}

using PairQueryObject = QueryObject<PairQuery>;
using ClosestQueryObject = QueryObject<ClosestQuery>;

void bind_pair_query(py::module_& m) {
    py::class_<PairQueryObject>(m, "PairQuery", py::is_final(),
                                "Queries between two posed trees. Owns scratch memory: keep one for all "
                                "frames. Answers are new arrays [pairs, 2] of rows of the two face arrays.")
        .def(py::init<>())
        .def(
            "intersecting",
            [](PairQueryObject& self, Posed& a, Posed& b) {
                return pair_array(answer(self, a, b, [](PairQuery& query, PosedTree& s, PosedTree& t) {
                    return query.intersecting(s, t);
                }));
            },
            py::arg("a"), py::arg("b"),
            "Face pairs that have a point in common, sorted; learned bounds give a subset.")
        .def(
            "within",
            [](PairQueryObject& self, Posed& a, Posed& b, double distance) {
                return pair_array(
                    answer(self, a, b, [d = checked_distance(distance)](auto& query, auto& s, auto& t) {
                        return query.within(s, t, d);
                    }));
            },
            py::arg("a"), py::arg("b"), py::arg("distance"),
            "Face pairs at most `distance` apart (metres), sorted.")
        .def(
            "boxes_within",
            [](PairQueryObject& self, Posed& a, Posed& b, double distance) {
                return pair_array(
                    answer(self, a, b, [d = checked_distance(distance)](auto& query, auto& s, auto& t) {
                        return query.boxes_within(s, t, d);
                    }));
            },
            py::arg("a"), py::arg("b"), py::arg("distance"),
            "All of within() and some more pairs of faces whose boxes come within `distance`, in no order.")
        .def_property_readonly(
            "counters", [](const PairQueryObject& self) { return counters_of(self.query.counters()); },
            "Counters of the last query.");
}

/// A query of a tree with itself, and the pairs that it leaves out.
struct SelfQueryObject {
    explicit SelfQueryObject(std::shared_ptr<FacePairSet> pairs)
        : left_out(std::move(pairs)), query(left_out) {}

    std::shared_ptr<FacePairSet> left_out;
    SelfQuery query;
    Lockable lock;
};

template <class Ask>
auto answer(SelfQueryObject& self, Posed& body, const Ask& ask) {
    const Use use(self.lock, "query");
    PosedTreeObject* const one[] = {&body};
    const UsePoses pose(one);
    const LongCall call;
    return ask(self.query, body.tree);
}

std::shared_ptr<FacePairSet> rest_pairs(py::handle X, py::handle F, double distance) {
    const VertexRows vertices(X, "X", 3);
    const IndexRows faces(F, "F", 3);
    const float d = checked_distance(distance);
    const LongCall call;
    return std::const_pointer_cast<FacePairSet>(near_at_rest(vertices.as<Vertices>(), faces.as<Faces>(), d));
}

void bind_self_query(py::module_& m) {
    py::class_<FacePairSet, std::shared_ptr<FacePairSet>>(m, "FacePairSet", "Pairs of faces of one surface.")
        .def("__len__", &FacePairSet::size)
        .def("__contains__", [](const FacePairSet& set, std::pair<int, int> pair) {
            const auto in_range = [&](int face) { return face >= 0 && face < set.face_count(); };
            return in_range(pair.first) && in_range(pair.second) && set.contains(pair.first, pair.second);
        });
    m.def("near_at_rest", &rest_pairs, py::arg("X"), py::arg("F"), py::arg("distance"),
          "The pairs of faces that are at most `distance` apart at rest, for SelfQuery to leave out.");
    py::class_<SelfQueryObject>(m, "SelfQuery", py::is_final(),
                                "Queries of a posed tree with itself. Leaves out faces that share a vertex.")
        .def(py::init<std::shared_ptr<FacePairSet>>(), py::arg("left_out") = py::none(),
             "left_out: further pairs to leave out.")
        .def(
            "intersecting",
            [](SelfQueryObject& self, Posed& body) {
                return pair_array(
                    answer(self, body, [](SelfQuery& query, PosedTree& b) { return query.intersecting(b); }));
            },
            py::arg("body"), "Pairs (a, b), a < b, of faces with a common point, sorted.")
        .def(
            "within",
            [](SelfQueryObject& self, Posed& body, double distance) {
                return pair_array(
                    answer(self, body, [d = checked_distance(distance)](SelfQuery& query, PosedTree& b) {
                        return query.within(b, d);
                    }));
            },
            py::arg("body"), py::arg("distance"), "Likewise pairs at most `distance` apart (metres).");
}

py::dict closest_faces(const ClosestFaces& found) {
    py::dict all;
    all["faces"] = py::make_tuple(found.faces.a, found.faces.b);
    all["a"] = owned(found.points.a);
    all["b"] = owned(found.points.b);
    all["distance"] = found.points.distance;
    return all;
}

py::object closest(ClosestQueryObject& self, Posed& a, Posed& b, double most) {
    if (!(most >= 0)) throw std::invalid_argument(fmt::format("most: is {}; allowed: at least 0", most));
    const auto found = answer(self, a, b, [most](ClosestQuery& query, PosedTree& s, PosedTree& t) {
        return query.closest(s, t, most);
    });
    return found ? py::object(closest_faces(*found)) : py::none();
}

void bind_closest_query(py::module_& m) {
    py::class_<ClosestQueryObject>(m, "ClosestQuery", py::is_final(), "Distances between two posed trees.")
        .def(py::init<>())
        .def("closest", &closest, py::arg("a"), py::arg("b"),
             py::arg("most") = std::numeric_limits<double>::infinity(),
             "The closest faces and points, {faces, a, b, distance}; "
             "None if further apart than `most` metres.");
}

struct ManyBodyObject {
    ManyBodyQuery query{
        [](int count, const std::function<void(int)>& task) { tbb::parallel_for(0, count, task); }};
    Lockable lock;
};

/// [(a, b, pairs), ...] of all bodies that touch.
template <class Ask>
py::list touching(ManyBodyObject& self, const std::vector<Posed*>& bodies, const Ask& ask) {
    if (const auto none = std::ranges::find(bodies, nullptr); none != bodies.end())
        throw std::invalid_argument(
            fmt::format("bodies[{}]: is None; allowed: a PosedTree", none - bodies.begin()));
    std::vector<Posed*> sorted = bodies;
    std::ranges::sort(sorted);
    if (std::ranges::adjacent_find(sorted) != sorted.end())
        throw std::invalid_argument("bodies: one PosedTree is there twice");
    const Use use(self.lock, "query");
    const UsePoses poses(bodies);
    std::vector<py::object> held;  // another thread may empty the list
    std::vector<PosedTree*> trees;
    for (Posed* body : bodies) {
        held.push_back(py::cast(body, py::return_value_policy::reference));
        trees.push_back(&body->tree);
    }
    const std::span<const TouchingBodies> found = long_call([&] { return ask(self.query, trees); });
    py::list all;
    for (const TouchingBodies& pair : found)
        all.append(py::make_tuple(pair.bodies.a, pair.bodies.b, pair_array(pair.faces)));
    return all;
}

void bind_many_body_query(py::module_& m) {
    py::class_<ManyBodyObject>(
        m, "ManyBodyQuery", py::is_final(),
        "Queries between all bodies of a list. Answers are lists of (a, b, pairs), a < "
        "b, of bodies that touch.")
        .def(py::init<>())
        .def(
            "intersecting",
            [](ManyBodyObject& self, const std::vector<Posed*>& bodies) {
                return touching(self, bodies,
                                [](ManyBodyQuery& query, auto& trees) { return query.intersecting(trees); });
            },
            py::arg("bodies"), "As PairQuery.intersecting() of all pairs.")
        .def(
            "within",
            [](ManyBodyObject& self, const std::vector<Posed*>& bodies, double distance) {
                return touching(self, bodies, [d = checked_distance(distance)](auto& query, auto& trees) {
                    return query.within(trees, d);
                });
            },
            py::arg("bodies"), py::arg("distance"), "As PairQuery.within() of all pairs.");
}

/// Two surfaces given as arrays.
struct TwoSurfaces {
    TwoSurfaces(py::handle xa, py::handle fa, py::handle xb, py::handle fb)
        : xa(xa, "xa", 3), xb(xb, "xb", 3), fa(fa, "fa", 3), fb(fb, "fb", 3) {}
    NodeRows xa, xb;
    IndexRows fa, fb;
};

void bind_one_shot(py::module_& m) {
    m.def(
        "intersecting_faces",
        [](py::handle xa, py::handle fa, py::handle xb, py::handle fb) {
            const TwoSurfaces of(xa, fa, xb, fb);
            return pair_array(long_call([&] {
                return intersecting_faces(of.xa.as<Nodes>(), of.fa.as<Faces>(), of.xb.as<Nodes>(),
                                          of.fb.as<Faces>());
            }));
        },
        py::arg("xa"), py::arg("fa"), py::arg("xb"), py::arg("fb"),
        "Pairs of faces of two surfaces that have a point in common, [pairs, 2]. Positions become "
        "float32 counted from a common origin, so that they may lie far from zero. For surfaces that move, "
        "keep a PosedTree for each and a PairQuery.");
    m.def(
        "face_pairs_within",
        [](py::handle xa, py::handle fa, py::handle xb, py::handle fb, double distance) {
            const TwoSurfaces of(xa, fa, xb, fb);
            const float d = checked_distance(distance);
            return pair_array(long_call([&] {
                return face_pairs_within(of.xa.as<Nodes>(), of.fa.as<Faces>(), of.xb.as<Nodes>(),
                                         of.fb.as<Faces>(), d);
            }));
        },
        py::arg("xa"), py::arg("fa"), py::arg("xb"), py::arg("fb"), py::arg("distance"),
        "Likewise pairs at most `distance` apart (metres).");
    m.def(
        "closest_points",
        [](py::handle xa, py::handle fa, py::handle xb, py::handle fb) {
            const TwoSurfaces of(xa, fa, xb, fb);
            return closest_faces(long_call([&] {
                return closest_points(of.xa.as<Nodes>(), of.fa.as<Faces>(), of.xb.as<Nodes>(),
                                      of.fb.as<Faces>());
            }));
        },
        py::arg("xa"), py::arg("fa"), py::arg("xb"), py::arg("fb"),
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
