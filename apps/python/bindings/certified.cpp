#include <fmt/format.h>
#include <pybind11/stl.h>

#include <cmath>
#include <memory>

#include "apps/python/bindings/bindings.hpp"
#include "apps/python/bindings/region_motions.hpp"
#include "apps/python/bindings/shared_tree.hpp"
#include "collision/bounds/certified/solid_meter.hpp"

namespace nbd::python {
namespace {

/// One number for each region, >= 0. Throws std::invalid_argument, one line, for others.
std::vector<float> bounds_from(py::handle value, const char* name) {
    const std::vector<double> numbers = number_list(value, name);
    for (const double number : numbers)
        if (!(number >= 0))
            throw std::invalid_argument(fmt::format(
                "{}: has {}; allowed: at least 0, or infinity where nothing is known", name, number));
    return {numbers.begin(), numbers.end()};
}

/// Rows of nine numbers from [regions, 3, 3].
VertexRows gradients_from(py::handle G) {
    const py::array array = py::array::ensure(G);
    PyErr_Clear();
    const bool fits = array && array.ndim() == 3 && array.shape(1) == 3 && array.shape(2) == 3;
    if (!fits)
        throw std::invalid_argument("G: has another shape; allowed: an array of numbers, [regions, 3, 3]");
    return {py::array(array).reshape({array.shape(0), py::ssize_t{9}}), "G", 9};
}

RegionMotions motions_from(py::handle deviation, py::handle stretch, const py::object& G) {
    const std::vector<float> deviations = bounds_from(deviation, "deviation"),
                             stretches = bounds_from(stretch, "stretch");
    RegionMotions motions;
    motions.all.resize(deviations.size());
    if (stretches.size() != deviations.size())
        throw std::invalid_argument(fmt::format("stretch: has {} regions, but deviation has {}",
                                                stretches.size(), deviations.size()));
    for (std::size_t r = 0; r < deviations.size(); ++r) {
        motions.all[r].deviation = deviations[r];
        motions.all[r].stretch = stretches[r];
    }
    if (G.is_none()) return motions;
    const VertexRows rows = gradients_from(G);
    rows.expect(static_cast<Eigen::Index>(deviations.size()), "G", "region");
    using NineRows = Eigen::Matrix<float, Eigen::Dynamic, 9, Eigen::RowMajor>;
    const auto all = rows.as<NineRows>();
    if (!all.allFinite()) throw std::invalid_argument("G: has a number that is not finite");
    for (Eigen::Index r = 0; r < all.rows(); ++r)
        motions.all[static_cast<std::size_t>(r)].G =
            Eigen::Map<const Eigen::Matrix<float, 3, 3, Eigen::RowMajor>>(all.row(r).data());
    return motions;
}

/// A read-only view of a member of all motions.
py::array member(py::handle self, const float* first, std::vector<py::ssize_t> shape,
                 std::vector<py::ssize_t> strides) {
    py::array array(py::dtype::of<float>(), std::move(shape), std::move(strides), first, self);
    protect(array);
    return array;
}

void bind_motions(py::module_& m) {
    constexpr auto row = static_cast<py::ssize_t>(sizeof(RegionMotion)), number = py::ssize_t{sizeof(float)};
    const auto motions_of = [](const py::object& self) -> const std::vector<RegionMotion>& {
        return self.cast<const RegionMotions&>().all;
    };
    py::class_<RegionMotions>(m, "RegionMotions",
                              "How the regions of certified bounds move in a pose: bounds on the deformation "
                              "gradients F of a region's tetrahedra. Does not change.")
        .def(py::init(&motions_from), py::arg("deviation"), py::arg("stretch"), py::arg("G") = py::none(),
             "deviation: |F - G| is at most this, spectral norm [regions]; stretch: |F| is [regions]; G: a "
             "mean "
             "gradient [regions, 3, 3], by default zero. Where only the stretch is known, give it twice. "
             "Raises ValueError for negative numbers, NaN and lists of other lengths.")
        .def_property_readonly(
            "deviation",
            [=](py::object self) {
                const auto& all = motions_of(self);
                return member(self, all.empty() ? nullptr : &all[0].deviation,
                              {static_cast<py::ssize_t>(all.size())}, {row});
            },
            "Greatest |F - G| [regions], float32. Refers to the object.")
        .def_property_readonly(
            "stretch",
            [=](py::object self) {
                const auto& all = motions_of(self);
                return member(self, all.empty() ? nullptr : &all[0].stretch,
                              {static_cast<py::ssize_t>(all.size())}, {row});
            },
            "Greatest |F| [regions], float32. Refers to the object.")
        .def_property_readonly(
            "G",
            [=](py::object self) {
                const auto& all = motions_of(self);
                return member(self, all.empty() ? nullptr : all[0].G.data(),
                              {static_cast<py::ssize_t>(all.size()), 3, 3}, {row, number, 3 * number});
            },
            "Gradients [regions, 3, 3], float32. Refers to the object.")
        .def("__len__", [](const RegionMotions& motions) { return motions.all.size(); });
}

struct SolidMeterObject {
    SolidMeterObject(const TetMesh& rest, const SharedTree& tree)
        : meter(rest, std::shared_ptr<const TetRegions>(tree, &tree->certified->regions)),
          nodes(rest.X.rows()) {}

    SolidMeter meter;
    Eigen::Index nodes;
    Lockable lock;
};

std::unique_ptr<SolidMeterObject> make_meter(const TetMesh& rest, const SharedTree& tree) {
    if (!tree->certified)
        throw std::invalid_argument(
            "tree: has no certified bounds; allowed: one of CollisionTree.with_certified() or train()");
    return std::make_unique<SolidMeterObject>(rest, tree);
}

RegionMotions measure(SolidMeterObject& self, py::handle x) {
    const VertexRows nodes(x, "nodes", 3);
    nodes.expect(self.nodes, "nodes", "node");
    const Use use(self.lock, "SolidMeter");
    const LongCall call;
    const auto motions = self.meter.measure(nodes.as<Vertices>());
    return {{motions.begin(), motions.end()}};
}

}  // namespace

void bind_certified(py::module_& m) {
    bind_motions(m);
    py::class_<SolidMeterObject>(
        m, "SolidMeter", py::is_final(),
        "Measures how the regions of a tree's certified bounds move, for poses without "
        "a World. One thread at a time may use it.")
        .def(py::init(&make_meter), py::arg("rest"), py::arg("tree").none(false),
             "rest: the tetrahedra at rest that the certified bounds were made with. Raises ValueError for "
             "others, and for a tree without certified bounds.")
        .def("measure", &measure, py::arg("nodes"),
             "RegionMotions of a pose. nodes: positions of the tet nodes [N, 3], metres; taken as float32. "
             "Infinite where a position is not finite.");
}

}  // namespace nbd::python
