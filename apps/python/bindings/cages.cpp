#include <fmt/format.h>
#include <pybind11/stl.h>

#include "apps/python/bindings/arrays.hpp"
#include "apps/python/bindings/bindings.hpp"
#include "apps/python/bindings/long_call.hpp"
#include "meshing/cage/cage_body.hpp"
#include "meshing/tets/tet_quality.hpp"

namespace nbd::python {
namespace {

py::tuple cage_body(const std::string& name, const TriMesh& surface, int nodes, const Material& material) {
    check_line(name, "name");
    CageBody caged = stoppable([&] { return make_cage_body(name, surface, nodes, material); });
    return py::make_tuple(std::make_shared<Body>(std::move(caged.body)), std::move(caged.report));
}

py::dict defects_of(const CageReport& report) {
    const SoupReport& soup = report.soup.given;
    py::dict all;
    all["repeating_faces"] = soup.repeating_faces;
    all["flat_faces"] = soup.flat_faces;
    all["duplicate_faces"] = soup.duplicate_faces;
    all["open_edges"] = soup.open_edges;
    all["crowded_edges"] = soup.crowded_edges;
    all["shells"] = soup.shells;
    all["unreferenced_vertices"] = report.soup.dropped_vertices;
    return all;
}

void bind_quality(py::module_& m) {
    py::class_<TetQuality>(
        m, "TetQuality",
        "Shapes of tetrahedra. Radius ratio: 3 x inradius / circumradius, 1 for the regular "
        "tetrahedron, 0 for a flat one, negative for an inverted one. Angles in degrees.")
        .def_readonly("nodes", &TetQuality::nodes)
        .def_readonly("tets", &TetQuality::tets)
        .def_readonly("volume", &TetQuality::volume, "m3, signed.")
        .def_readonly("volume_min", &TetQuality::volume_min, "m3, signed.")
        .def_readonly("radius_ratio_min", &TetQuality::radius_ratio_min)
        .def_readonly("radius_ratio_mean", &TetQuality::radius_ratio_mean)
        .def_readonly("dihedral_min", &TetQuality::dihedral_min)
        .def_readonly("dihedral_max", &TetQuality::dihedral_max)
        .def_readonly("worst_tet", &TetQuality::worst_tet, "The tetrahedron of the least ratio; -1 for none.")
        .def_readonly("poor", &TetQuality::poor,
                      "Tetrahedra of a radius ratio below 0.1: steps are stiff there.")
        .def_readonly("radius_ratio_histogram", &TetQuality::radius_ratio_histogram,
                      "Ten counts, of ratios in [0, 0.1), [0.1, 0.2) ...; the first includes those below 0.")
        .def("__str__", [](const TetQuality& quality) { return to_text(quality); });
    m.def(
        "tet_quality",
        [](const TetMesh& tets) {
            const LongCall call;
            return tet_quality(tets);
        },
        py::arg("tets"), "Measures the shapes of tetrahedra, such as Body.tets.");
}

}  // namespace

void bind_cages(py::module_& m) {
    py::class_<CageReport>(m, "CageReport", "How a cage around a surface came about; see make_cage_body().")
        .def_readonly("vertices", &CageReport::vertices)
        .def_readonly("faces", &CageReport::faces)
        .def_readonly("volume", &CageReport::volume, "Of the cage, m3.")
        .def_readonly("alpha", &CageReport::alpha, "Radius of the ball that the wrap kept out, metres.")
        .def_readonly("offset", &CageReport::offset, "Of the cage's vertices from the surface, metres.")
        .def_readonly("distance", &CageReport::distance, "Greatest between cage and surface, metres.")
        .def_readonly("closes_holes", &CageReport::closes_holes,
                      "Whether a finer cage would have entered the surface through its holes.")
        .def_readonly("joins_parts", &CageReport::joins_parts,
                      "Whether a finer cage would have fallen into parts.")
        .def_property_readonly("defects", &defects_of,
                               "Counts of what keeps the surface from bounding a solid.")
        .def_property_readonly(
            "tets_optimised",
            [](const CageReport& report) {
                return report.optimization.poor_before - report.optimization.poor_after;
            },
            "Poor tetrahedra that were mended.")
        .def("__str__", [](const CageReport& report) { return describe(report); });
    m.def("make_cage_body", &cage_body, py::arg("name"), py::arg("surface"), py::arg("nodes"),
          py::arg("material") = Material{},
          "A body of any triangle soup, such as a scan: a coarse cage around it is filled with "
          "`nodes` tet nodes (50 to 200,000, met within 10 %), and the surface is embedded. "
          "Returns the Body and a CageReport. Raises ValueError for a soup without extent, "
          "and where no cage of so many nodes holds it.");
    bind_quality(m);
}

}  // namespace nbd::python
