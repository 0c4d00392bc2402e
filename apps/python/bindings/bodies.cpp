#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "apps/cli/mesh_file.hpp"
#include "apps/python/bindings/arrays.hpp"
#include "apps/python/bindings/bindings.hpp"
#include "apps/python/bindings/long_call.hpp"
#include "apps/python/bindings/typed.hpp"
#include "collision/base/notice.hpp"
#include "meshing/body/body.hpp"
#include "meshing/body/body_hints.hpp"
#include "meshing/body/make_body.hpp"
#include "meshing/body/rigid_body.hpp"
#include "meshing/cage/cage_body.hpp"
#include "meshing/surface/solid_boundary.hpp"
#include "meshing/tets/tet_quality.hpp"
#include "sim/fem/modes.hpp"

namespace nbd::python {
namespace {

using std::filesystem::path;
using SharedBody = std::shared_ptr<Body>;

Material make_material(double young, double poisson, double density, double rayleigh_mass,
                       double rayleigh_stiffness, MaterialLaw law) {
    const Material material{young, poisson, density, rayleigh_mass, rayleigh_stiffness, law};
    check_material(material);
    return material;
}

SharedBody body_of(const std::string& name, const TetMesh& tets, const std::optional<TriMesh>& surface,
                   const Material& material, int levels, SubdivisionScheme scheme) {
    check_line(name, "name");
    return std::make_shared<Body>(surface ? make_body(name, *surface, tets, material, levels, scheme)
                                          : make_body(name, tets, material, levels, scheme));
}

/// Throws std::invalid_argument where two options are given of which a file takes one alone.
void exclude(bool first, const char* name, bool second, const char* other) {
    if (first && second) throw std::invalid_argument(fmt::format("{}: excludes {}", name, other));
}

SharedBody mesh_body(const path& file, std::optional<int> nodes, std::optional<double> grading,
                     std::optional<int> cage, const std::optional<path>& inside,
                     const std::optional<Material>& material, std::optional<int> levels,
                     std::optional<SubdivisionScheme> scheme, double scale, std::optional<double> weld,
                     std::optional<Elements> elements, std::optional<double> edge,
                     std::optional<double> error) {
    const bool has_tets = holds_tets(file), has_material = file.extension() == ".h5" || inside;
    exclude(cage.has_value(), "cage", inside.has_value(), "inside");
    exclude(elements.has_value(), "elements", inside.has_value(), "inside");
    for (const auto& [option, name] :
         {std::pair(cage.has_value(), "cage"), std::pair(inside.has_value(), "inside")}) {
        exclude(option, name, has_tets, "files that hold tetrahedra");
        exclude(option, name, nodes || grading || edge || error, "nodes, grading, edge and error");
        exclude(option, name, levels || scheme, "levels and scheme");
    }
    exclude(has_tets, "a file that holds tetrahedra", nodes || grading || edge || error,
            "nodes, grading, edge and error");
    exclude(edge.has_value(), "edge", nodes || error, "nodes and error");
    exclude(error.has_value(), "error", nodes || elements, "nodes and elements");
    exclude(has_tets, "a file that holds tetrahedra", weld.has_value(), "weld");
    for (const auto& [number, name] :
         {std::pair(scale, "scale"), std::pair(weld.value_or(1), "weld"), std::pair(edge.value_or(1), "edge"),
          std::pair(error.value_or(1), "error")})
        if (!(number > 0 && std::isfinite(number)))
            throw std::invalid_argument(fmt::format("{}: is {}; allowed: more than 0", name, number));
    exclude(has_material, "a body that has a material", material.has_value(), "material");
    if (cage && *cage < 1)
        throw std::invalid_argument(fmt::format("cage: is {}; allowed: at least 1", *cage));
    MeshFileConfig config{{.tets = {},
                           .error = grading && !error ? std::optional(0.0) : error,
                           .edge = edge.value_or(0),
                           .elements = elements,
                           .scale = scale,
                           .weld = weld.value_or(0),
                           .levels = levels.value_or(0),
                           .scheme = scheme.value_or(SubdivisionScheme::midpoint)},
                          cage.value_or(0),
                          inside.value_or(path()).string(),
                          material.value_or(Material{})};
    if (nodes) config.tets.nodes = *nodes;
    if (grading) config.tets.grading = *grading;
    Output silent;
    silent.quiet = true;
    auto body = std::make_shared<Body>(mesh_file(file, config, silent).body);
    for (const std::string& hint : body_hints(*body)) notice(fmt::format("{}: {}", file.string(), hint));
    return body;
}

SharedBody with_modes(const Body& body, const Modes& modes) {
    auto copy = std::make_shared<Body>(body);
    copy->modes = modes.basis;
    check_body(*copy);
    return copy;
}

SharedBody with_material(const Body& body, const Material& material) {
    auto copy = std::make_shared<Body>(body);
    copy->material = material;
    copy->modes = {};
    check_body(*copy);
    return copy;
}

Typed<"Optional[Tuple[Floats, Doubles]]"> modes_of(py::object self) {
    const ModeBasis& modes = self.cast<const Body&>().modes;
    if (modes.count() == 0) return py::none();
    constexpr auto refer = py::return_value_policy::reference_internal;
    return py::make_tuple(py::cast(modes.U, refer, self), py::cast(modes.frequencies, refer, self));
}

void bind_material(py::module_& m) {
    const Material defaults;
    py::class_<Material>(m, "Material", "An isotropic elastic material.")
        .def(py::init(&make_material), py::arg("young") = defaults.young,
             py::arg("poisson") = defaults.poisson, py::arg("density") = defaults.density,
             py::arg("rayleigh_mass") = defaults.rayleigh_mass,
             py::arg("rayleigh_stiffness") = defaults.rayleigh_stiffness, py::arg("law") = defaults.law,
             "young: Pa; density: kg/m3; rayleigh_mass: 1/s; rayleigh_stiffness: s; law: corotated, "
             "stable_neo_hookean or st_venant_kirchhoff.")
        .def_readonly("young", &Material::young)
        .def_readonly("poisson", &Material::poisson)
        .def_readonly("density", &Material::density)
        .def_readonly("rayleigh_mass", &Material::rayleigh_mass)
        .def_readonly("rayleigh_stiffness", &Material::rayleigh_stiffness)
        .def_readonly("law", &Material::law)
        .def("__repr__",
             [](const Material& material) {
                 return fmt::format(
                     "nbdtree.Material(young={}, poisson={}, density={}, rayleigh_mass={}, "
                     "rayleigh_stiffness={}, law='{}')",
                     material.young, material.poisson, material.density, material.rayleigh_mass,
                     material.rayleigh_stiffness, name(material.law));
             })
        .def(
            "__eq__", [](const Material& a, const Material& b) { return a == b; }, py::is_operator());
}

void bind_modes(py::module_& m) {
    py::class_<Modes>(m, "Modes", "Vibration modes of a free body, see vibration_modes().")
        .def_property_readonly(
            "U", [](const Modes& modes) -> const auto& { return modes.basis.U; },
            "[3 N, m] float32: x y z of node 0 first. Refers to the object.")
        .def_property_readonly(
            "frequencies", [](const Modes& modes) -> const auto& { return modes.basis.frequencies; },
            "[m] Hz, ascending. Refers to the object.")
        .def_property_readonly("max_residual", [](const Modes& modes) { return modes.report.max_residual; })
        .def_property_readonly("max_rigid_hz", [](const Modes& modes) { return modes.report.max_rigid_hz; });
}

std::pair<std::shared_ptr<Body>, CageReport> cage_body(const std::string& name, const TriMesh& surface,
                                                       int nodes, const Material& material) {
    check_line(name, "name");
    CageBody caged = make_cage_body(name, surface, nodes, material);
    return {std::make_shared<Body>(std::move(caged.body)), std::move(caged.report)};
}

Typed<"dict[str, int]"> defects_of(const CageReport& report) {
    const SoupReport& soup = report.soup;
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
        .def_property_readonly(
            "radius_ratio_histogram",
            [](const TetQuality& quality) {
                return std::vector<int>(quality.radius_ratio_histogram.begin(),
                                        quality.radius_ratio_histogram.end());
            },
            "Ten counts, of ratios in [0, 0.1), [0.1, 0.2) ...; the first includes those below 0.")
        .def("__str__", [](const TetQuality& quality) { return to_text(quality); });
    m.def("tet_quality", &tet_quality, py::arg("tets"), Computes(),
          "Measures the shapes of tetrahedra, such as Body.tets.");
}

void bind_cages(py::module_& m) {
    py::class_<CageReport>(m, "CageReport", "How a cage around a surface came about; see make_cage_body().")
        .def_readonly("vertices", &CageReport::vertices)
        .def_readonly("faces", &CageReport::faces)
        .def_readonly("volume", &CageReport::volume, "Of the cage, m3.")
        .def_readonly("material", &CageReport::material, "Of what the body fills of it, m3.")
        .def_readonly("why_wrapped", &CageReport::why_wrapped,
                      "Why that was taken from a close wrap, such as an open surface; or empty.")
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
    m.def(
        "make_cage_body", &cage_body, py::arg("name"), py::arg("surface"), py::arg("nodes"),
        py::arg("material") = Material{}, ComputesLong(),
        "A body of any triangle soup, such as a scan: a coarse cage around it is filled with "
        "`nodes` tet nodes (50 to 200,000, met within 10 %), and the surface is embedded. Mass and stiffness "
        "are those of the solid that the surface bounds. "
        "Returns the Body and a CageReport. Raises ValueError for a soup without extent, "
        "and where no cage of so many nodes holds it.");
    bind_quality(m);
}

}  // namespace

void bind_bodies(py::module_& m) {
    bind_material(m);
    bind_modes(m);
    py::class_<Body, SharedBody>(m, "Body",
                                 "A deformable body at rest: tetrahedra, a collision surface that hangs on "
                                 "them, a material. It does not change.")
        .def_readonly("name", &Body::name)
        .def_readonly("origin", &Body::origin,
                      "[3] metres: what its positions are counted from; zero unless the body lies far away.")
        .def_property_readonly(
            "X", [](const Body& body) -> const Nodes& { return body.tets.X; },
            "Rest positions of the tet nodes [N, 3], metres. Refers to the body.")
        .def_property_readonly(
            "T", [](const Body& body) -> const Tets& { return body.tets.T; },
            "Tetrahedra [T, 4]. Refers to the body.")
        .def_property_readonly(
            "fill", [](const Body& body) -> const TetFill& { return body.tets.fill; },
            "[T, 10] how much of each tetrahedron material fills: means of its ten shape functions; [0, 10] if "
            "all are full, as without a cage. Refers to the object.")
        .def_property_readonly(
            "E", [](const Body& body) -> const TetEdges& { return body.tets.E; },
            "Nodes of the edges of quadratic tetrahedra [T, 6], else [0, 6]. Refers to the body.")
        .def_property_readonly(
            "surface_X", [](const Body& body) -> const Nodes& { return body.surface.X; },
            "Rest positions of the collision surface [n, 3], metres. Refers to the body.")
        .def_property_readonly(
            "F", [](const Body& body) -> const Faces& { return body.surface.F; },
            "Faces of the collision surface [m, 3]. Refers to the body.")
        .def_readonly("tets", &Body::tets, "The tetrahedra as a TetMesh. Refers to the body.")
        .def_readonly("surface", &Body::surface, "The collision surface as a TriMesh. Refers to the body.")
        .def_property_readonly(
            "W", [](py::object self) { return embedding_views(self.cast<const Body&>().W, self); },
            "The weights that carry nodes to the surface, (data, indices, indptr) as scipy.sparse.csr_matrix "
            "takes them, [n, N]. Refers to the body.")
        .def(
            "surface_positions",
            [](const Body& body, const Rows<Nodes, "x">& x) {
                expect_nodes(x.count(), body.W.cols());
                return embedded(body.W, *x);
            },
            py::arg("x"), "Positions of the surface, W x, for node positions x [N, 3]. A new array.")
        .def_readonly("material", &Body::material)
        .def_readonly("bending_error", &Body::bending_error,
                      "By how much the body bends too little, as `nbdtree mesh` estimated; "
                      "None: not known.")
        .def_property_readonly("modes", &modes_of, "None, or (U, frequencies). Refers to the body.")
        .def_property_readonly(
            "hash", &body_hash,
            "SHA-256 of tetrahedra, surface and weights, which recordings and trees store.")
        .def("with_modes", &with_modes, py::arg("modes"), "The same body with these modes.")
        .def("with_material", &with_material, py::arg("material"),
             "The same body of another material, without modes.")
        .def("__repr__", [](const Body& body) {
            return fmt::format("<nbdtree.Body '{}': {} nodes, {} tetrahedra, {} faces, {} modes>", body.name,
                               body.tets.X.rows(), body.tets.T.rows(), body.surface.F.rows(),
                               body.modes.count());
        });
    m.def(
        "make_body", &body_of, py::arg("name"), py::arg("tets"), py::arg("surface") = py::none(),
        py::arg("material") = Material{}, py::arg("levels") = 0,
        py::arg("scheme") = SubdivisionScheme::midpoint, Computes(),
        "A body of tetrahedra and a closed surface in or near them; without one, of their boundary. levels: "
        "how often the collision surface is subdivided.");
    m.def(
        "make_rigid_body",
        [](const std::string& name, const TriMesh& surface, std::optional<double> density,
           std::optional<double> mass, const std::optional<Eigen::Vector3d>& centre,
           const std::optional<Eigen::Matrix3d>& moments) {
            check_line(name, "name");
            if (density && mass) throw std::invalid_argument("density: must not be beside mass");
            if (!mass && (centre || moments))
                throw std::invalid_argument("mass: is missing beside centre or moments");
            SolidBoundary solid = make_solid_boundary(surface, {.allow_components = true});
            return std::make_shared<Body>(
                mass ? make_rigid_body(name, std::move(solid.mesh),
                                       {.mass = *mass, .centre = centre, .moments = moments})
                     : make_rigid_body(name, std::move(solid.mesh), density.value_or(Material{}.density)));
        },
        py::arg("name"), py::arg("surface"), py::arg("density") = py::none(), py::arg("mass") = py::none(),
        py::arg("centre") = py::none(), py::arg("moments") = py::none(), Computes(),
        "A rigid body with the mass, centre and inertia of what a closed surface encloses: the surface hangs on "
        "the four nodes of one stiff tetrahedron around it. density: kg/m3, by default that of Material. In its "
        "place a mass, kg, and if given the centre of mass, [3] metres, and the tensor of inertia about it, "
        "[3, 3] kg m2. Raises ValueError for a surface that is open, intersects itself or has no volume, and for "
        "moments that no mass in about the surface's place has.");
    m.def(
        "mesh_file", &mesh_body, py::arg("path"), py::arg("nodes") = py::none(),
        py::arg("grading") = py::none(), py::arg("cage") = py::none(), py::arg("inside") = py::none(),
        py::arg("material") = py::none(), py::arg("levels") = py::none(), py::arg("scheme") = py::none(),
        py::arg("scale") = 1.0, py::arg("weld") = py::none(), py::arg("elements") = py::none(),
        py::arg("edge") = py::none(), py::arg("error") = py::none(), UsesFilesLong(),
        "Makes a body from a file as `nbdtree mesh` does: a closed surface is checked and filled; with "
        "`cage`, a number of tetrahedra's corners, any triangle soup is embedded in a coarse cage. scale: of all "
        "coordinates, 0.001 for millimetres. weld: cracks up to this length, metres, are closed. "
        "elements: linear or quadratic; None: as in the file. "
        "edge: length of the tetrahedra's edges at the surface, metres. error: searches for quadratic "
        "tetrahedra that bend with at most this error, in a cage if need be; to 0.03 where nodes, grading, edge "
        "and elements are None, too. Warns "
        "(UserWarning) of a body whose size, tetrahedra or Poisson's ratio may make its motion wrong.");
    m.def("save_body", &write_checked<save_body, Body>, py::arg("path"), py::arg("body"), UsesFiles(),
          "Writes a body file under a temporary name and renames it.");
    m.def(
        "load_body", [](const path& file) { return std::make_shared<Body>(load_body(file)); },
        py::arg("path"), UsesFiles(), "Reads a body file.");
    m.def(
        "vibration_modes",
        [](const Body& body, int count, std::uint64_t seed) {
            return vibration_modes(ElasticBody(body), {.count = count, .seed = seed});
        },
        py::arg("body"), py::arg("count") = 128, py::arg("seed") = 1, ComputesLong(),
        "The lowest elastic vibration modes of the free body at rest. The same seed gives the same bits.");
    bind_cages(m);
}

}  // namespace nbd::python
