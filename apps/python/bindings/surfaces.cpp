#include <fmt/format.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "apps/cli/output_paths.hpp"
#include "apps/python/bindings/arrays.hpp"
#include "apps/python/bindings/bindings.hpp"
#include "apps/python/bindings/long_call.hpp"
#include "apps/python/bindings/scheme.hpp"
#include "meshing/formats/read_surface.hpp"
#include "meshing/formats/read_tets.hpp"
#include "meshing/formats/write_surface.hpp"
#include "meshing/surface/solid_boundary.hpp"
#include "meshing/surface/subdivide.hpp"
#include "meshing/tets/tetrahedralize.hpp"

namespace nbd::python {
namespace {

using std::filesystem::path;

/// Throws std::invalid_argument for an index that no row of the positions has.
template <class Cells>
void check_indices(const Cells& cells, Eigen::Index count, const char* name) {
    if (cells.size() > 0 && (cells.minCoeff() < 0 || cells.maxCoeff() >= count))
        throw std::invalid_argument(fmt::format("{}: index {} is not in 0..{}", name,
                                                cells.minCoeff() < 0 ? cells.minCoeff() : cells.maxCoeff(),
                                                count - 1));
}

TriMesh surface_from(py::handle X, py::handle F) {
    TriMesh mesh{NodeRows(X, "X", 3).as<Nodes>(), IndexRows(F, "F", 3).as<Faces>()};
    check_indices(mesh.F, mesh.X.rows(), "F");
    return mesh;
}

TetMesh tets_from(py::handle X, py::handle T) {
    TetMesh mesh{NodeRows(X, "X", 3).as<Nodes>(), IndexRows(T, "T", 4).as<Tets>()};
    check_indices(mesh.T, mesh.X.rows(), "T");
    return mesh;
}

TetMesh tetrahedralize_surface(const TriMesh& surface, int nodes, double tolerance, double grading) {
    return stoppable([&] {
        return tetrahedralize(surface, {.nodes = nodes, .tolerance = tolerance, .grading = grading}).tets;
    });
}

py::tuple solid_boundary(const TriMesh& surface, bool components, bool self_intersection) {
    SolidBoundary solid;
    {
        const LongCall call;
        solid = make_solid_boundary(
            surface, {.allow_components = components, .allow_self_intersection = self_intersection});
    }
    return py::make_tuple(std::move(solid.mesh), describe(solid.report));
}

TriMesh subdivided(const TriMesh& surface, int levels, const std::string& name) {
    const SubdivisionScheme scheme = scheme_named(name);
    const LongCall call;
    return subdivide(surface, scheme, levels).mesh;
}

}  // namespace

void bind_surfaces(py::module_& m) {
    py::class_<TriMesh>(m, "TriMesh", "A triangle mesh.")
        .def(py::init(&surface_from), py::arg("X"), py::arg("F"),
             "X: positions [n, 3], metres; F: faces [m, 3]. Both are copied.")
        .def_property_readonly(
            "X", [](py::object self) { return view(self.cast<const TriMesh&>().X, self); },
            "Positions [n, 3], float64, metres. Refers to the mesh.")
        .def_property_readonly(
            "F", [](py::object self) { return view(self.cast<const TriMesh&>().F, self); },
            "Faces [m, 3], int32, counter-clockwise seen from outside. Refers to the mesh.")
        .def("__repr__", [](const TriMesh& mesh) {
            return fmt::format("<nbdtree.TriMesh: {} vertices, {} faces>", mesh.X.rows(), mesh.F.rows());
        });
    py::class_<TetMesh>(m, "TetMesh", "A tetrahedral mesh.")
        .def(py::init(&tets_from), py::arg("X"), py::arg("T"),
             "X: positions [N, 3], metres; T: tetrahedra [T, 4], positively oriented. Both are copied.")
        .def_property_readonly(
            "X", [](py::object self) { return view(self.cast<const TetMesh&>().X, self); },
            "Positions [N, 3], float64, metres. Refers to the mesh.")
        .def_property_readonly(
            "T", [](py::object self) { return view(self.cast<const TetMesh&>().T, self); },
            "Tetrahedra [T, 4], int32. Refers to the mesh.")
        .def("__repr__", [](const TetMesh& mesh) {
            return fmt::format("<nbdtree.TetMesh: {} nodes, {} tetrahedra>", mesh.X.rows(), mesh.T.rows());
        });
    m.def(
        "read_surface",
        [](const path& file) {
            const LongCall call;
            return read_surface(file);
        },
        py::arg("path"),
        "Reads the triangles of a .obj, .ply, .stl, .off or .glb file; see make_solid_boundary().");
    m.def(
        "write_surface",
        [](const path& file, const TriMesh& mesh) {
            check_output(file, {});
            const LongCall call;
            write_surface(file, mesh.X, mesh.F);
        },
        py::arg("path"), py::arg("mesh"),
        "Writes a .obj or .ply file under a temporary name and renames it; "
        "positions are rounded to float32.");
    m.def(
        "read_tets",
        [](const path& file) {
            const LongCall call;
            return read_tets(file);
        },
        py::arg("path"), "Reads tetrahedra made by another program: .msh, .mesh, .vtk or .vtu.");
    m.def("make_solid_boundary", &solid_boundary, py::arg("surface"), py::arg("allow_components") = false,
          py::arg("allow_self_intersection") = false,
          "Checks that a surface bounds a solid, drops unused vertices and turns faces outward. "
          "Returns the mesh and one line about it. Raises ValueError, naming the first face, "
          "edge or vertex, if it bounds none.");
    m.def("tetrahedralize", &tetrahedralize_surface, py::arg("surface"), py::arg("nodes") = 0,
          py::arg("tolerance") = 0.05, py::arg("grading") = 0.2,
          "Fills a closed surface with tetrahedra. nodes: desired number, 0: as `grading` gives. The first "
          "nodes are the surface's vertices.");
    m.def("subdivide", &subdivided, py::arg("surface"), py::arg("levels") = 1, py::arg("scheme") = "midpoint",
          "Splits every face into four, `levels` times. scheme: midpoint or loop.");
}

}  // namespace nbd::python
