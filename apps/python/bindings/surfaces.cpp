#include <fmt/format.h>

#include <string>
#include <utility>

#include "apps/python/bindings/arrays.hpp"
#include "apps/python/bindings/bindings.hpp"
#include "apps/python/bindings/long_call.hpp"
#include "apps/python/bindings/typed.hpp"
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

TriMesh surface_from(const Rows<Nodes, "X">& X, const Rows<Faces, "F">& F) {
    TriMesh mesh{*X, *F};
    check_indices(mesh.F, mesh.X.rows(), "F");
    return mesh;
}

TetMesh tets_from(const Rows<Nodes, "X">& X, const Rows<Tets, "T">& T) {
    TetMesh mesh{*X, *T};
    check_indices(mesh.T, mesh.X.rows(), "T");
    return mesh;
}

TetMesh tetrahedralize_surface(const TriMesh& surface, int nodes, double tolerance, double grading) {
    return tetrahedralize(surface, {.nodes = nodes, .tolerance = tolerance, .grading = grading}).tets;
}

std::pair<TriMesh, std::string> solid_boundary(const TriMesh& surface, bool components,
                                               bool self_intersection) {
    SolidBoundary solid = make_solid_boundary(
        surface, {.allow_components = components, .allow_self_intersection = self_intersection});
    return {std::move(solid.mesh), describe(solid.report)};
}

void write_mesh(const path& file, const TriMesh& mesh) { write_surface(file, mesh.X, mesh.F); }

}  // namespace

void bind_surfaces(py::module_& m) {
    py::class_<TriMesh>(m, "TriMesh", "A triangle mesh.")
        .def(py::init(&surface_from), py::arg("X"), py::arg("F"),
             "X: positions [n, 3], metres; F: faces [m, 3]. Both are copied.")
        .def_readonly("X", &TriMesh::X, "Positions [n, 3], float64, metres. Refers to the mesh.")
        .def_readonly("F", &TriMesh::F,
                      "Faces [m, 3], int32, counter-clockwise seen from outside. Refers to the mesh.")
        .def("__repr__", [](const TriMesh& mesh) {
            return fmt::format("<nbdtree.TriMesh: {} vertices, {} faces>", mesh.X.rows(), mesh.F.rows());
        });
    py::class_<TetMesh>(m, "TetMesh",
                        "A mesh of linear tetrahedra, or of quadratic ones on Bezier control points: see "
                        "make_quadratic().")
        .def(py::init(&tets_from), py::arg("X"), py::arg("T"),
             "X: positions [N, 3], metres; T: tetrahedra [T, 4], positively oriented. Both are copied.")
        .def_readonly("X", &TetMesh::X, "Positions [N, 3], float64, metres. Refers to the mesh.")
        .def_readonly("T", &TetMesh::T, "Tetrahedra [T, 4], int32. Refers to the mesh.")
        .def_readonly(
            "E", &TetMesh::E,
            "Of quadratic tetrahedra, the nodes of their edges 01 02 03 12 13 23 [T, 6], int32; else "
            "[0, 6]. Refers to the mesh.")
        .def("__repr__", [](const TetMesh& mesh) {
            return fmt::format("<nbdtree.TetMesh: {} nodes, {} tetrahedra>", mesh.X.rows(), mesh.T.rows());
        });
    m.def(
        "make_quadratic", [](const TetMesh& tets) { return as_elements(tets, Elements::quadratic); },
        py::arg("tets"), Computes(),
        "The same tetrahedra as quadratic ones: with a node for each edge, behind the nodes of the mesh. The "
        "point of barycentric coordinates z lies at sum z_a^2 x_a + sum 2 z_a z_b x_ab, over corners and "
        "edges.");
    m.def(
        "read_surface", [](const path& file) { return read_surface(file); }, py::arg("path"), Computes(),
        "Reads the triangles of a .obj, .ply, .stl, .off or .glb file; see make_solid_boundary().");
    m.def("write_surface", &write_checked<write_mesh, TriMesh>, py::arg("path"), py::arg("mesh"), Computes(),
          "Writes a .obj or .ply file under a temporary name and renames it; "
          "positions are rounded to float32.");
    m.def(
        "read_tets", [](const path& file) { return read_tets(file); }, py::arg("path"), Computes(),
        "Reads tetrahedra made by another program: .msh, .mesh, .vtk, .vtu or .inp.");
    m.def("make_solid_boundary", &solid_boundary, py::arg("surface"), py::arg("allow_components") = false,
          py::arg("allow_self_intersection") = false, Computes(),
          "Checks that a surface bounds a solid, drops unused vertices and turns faces outward. "
          "Returns the mesh and one line about it. Raises ValueError, naming the first face, "
          "edge or vertex, if it bounds none.");
    m.def("tetrahedralize", &tetrahedralize_surface, py::arg("surface"), py::arg("nodes") = 0,
          py::arg("tolerance") = 0.05, py::arg("grading") = 0.2, ComputesLong(),
          "Fills a closed surface with tetrahedra. nodes: desired number, 0: as `grading` gives. The first "
          "nodes are the surface's vertices.");
    m.def(
        "subdivide",
        [](const TriMesh& surface, int levels, SubdivisionScheme scheme) {
            return subdivide(surface, scheme, levels).mesh;
        },
        py::arg("surface"), py::arg("levels") = 1, py::arg("scheme") = SubdivisionScheme::midpoint,
        Computes(), "Splits every face into four, `levels` times. scheme: midpoint or loop.");
}

}  // namespace nbd::python
