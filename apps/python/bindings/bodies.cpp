#include <fmt/format.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <cmath>

#include "apps/cli/mesh_file.hpp"
#include "apps/cli/output_paths.hpp"
#include "apps/python/bindings/arrays.hpp"
#include "apps/python/bindings/bindings.hpp"
#include "apps/python/bindings/long_call.hpp"
#include "apps/python/bindings/scheme.hpp"
#include "collision/base/notice.hpp"
#include "meshing/body/body.hpp"
#include "meshing/body/body_hints.hpp"
#include "meshing/body/make_body.hpp"
#include "sim/fem/modes.hpp"

namespace nbd::python {
namespace {

using std::filesystem::path;
using SharedBody = std::shared_ptr<Body>;

MaterialLaw law_named(const std::string& text) {
    if (const auto law = material_law(text)) return *law;
    throw std::invalid_argument(
        fmt::format("law: is \"{}\"; allowed: corotated, stable_neo_hookean, st_venant_kirchhoff", text));
}

Material make_material(double young, double poisson, double density, double rayleigh_mass,
                       double rayleigh_stiffness, const std::string& law) {
    const Material material{young, poisson, density, rayleigh_mass, rayleigh_stiffness, law_named(law)};
    check_material(material);
    return material;
}

SharedBody body_of(const std::string& name, const TetMesh& tets, const std::optional<TriMesh>& surface,
                   const Material& material, int levels, const std::string& scheme) {
    check_line(name, "name");
    const SubdivisionScheme subdivision = scheme_named(scheme);
    const LongCall call;
    return std::make_shared<Body>(surface ? make_body(name, *surface, tets, material, levels, subdivision)
                                          : make_body(name, tets, material, levels, subdivision));
}

/// Throws std::invalid_argument where two options are given of which a file takes one alone.
void exclude(bool first, const char* name, bool second, const char* other) {
    if (first && second) throw std::invalid_argument(fmt::format("{}: excludes {}", name, other));
}

SharedBody mesh_body(const path& file, std::optional<int> nodes, std::optional<double> grading,
                     std::optional<int> cage, const std::optional<path>& inside,
                     const std::optional<Material>& material, std::optional<int> levels,
                     const std::optional<std::string>& scheme, double scale, std::optional<double> weld) {
    const bool has_tets = holds_tets(file), has_material = file.extension() == ".h5" || inside;
    exclude(cage.has_value(), "cage", inside.has_value(), "inside");
    for (const auto& [option, name] :
         {std::pair(cage.has_value(), "cage"), std::pair(inside.has_value(), "inside")}) {
        exclude(option, name, has_tets, "files that hold tetrahedra");
        exclude(option, name, nodes || grading, "nodes and grading");
        exclude(option, name, levels || scheme, "levels and scheme");
    }
    exclude(has_tets, "a file that holds tetrahedra", nodes || grading, "nodes and grading");
    exclude(has_tets, "a file that holds tetrahedra", weld.has_value(), "weld");
    for (const auto& [number, name] : {std::pair(scale, "scale"), std::pair(weld.value_or(1), "weld")})
        if (!(number > 0 && std::isfinite(number)))
            throw std::invalid_argument(fmt::format("{}: is {}; allowed: more than 0", name, number));
    exclude(has_material, "a body that has a material", material.has_value(), "material");
    if (cage && *cage < 1)
        throw std::invalid_argument(fmt::format("cage: is {}; allowed: at least 1", *cage));
    MeshFileConfig config{.tets = {},
                          .cage = cage.value_or(0),
                          .inside = inside.value_or(path()).string(),
                          .scale = scale,
                          .weld = weld.value_or(0),
                          .material = material.value_or(Material{}),
                          .levels = levels.value_or(0),
                          .scheme = scheme_named(scheme.value_or("midpoint"))};
    if (nodes) config.tets.nodes = *nodes;
    if (grading) config.tets.grading = *grading;
    Output silent;
    silent.quiet = true;
    return stoppable<FileCall>([&] {
        auto body = std::make_shared<Body>(mesh_file(file, config, silent).body);
        for (const std::string& hint : body_hints(*body)) notice(fmt::format("{}: {}", file.string(), hint));
        return body;
    });
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

py::object modes_of(py::object self) {
    const auto& modes = self.cast<const Body&>().modes;
    if (modes.count() == 0) return py::none();
    return py::make_tuple(view(modes.U, self), view(modes.frequencies, self));
}

void bind_material(py::module_& m) {
    const Material defaults;
    py::class_<Material>(m, "Material", "An isotropic elastic material.")
        .def(py::init(&make_material), py::arg("young") = defaults.young,
             py::arg("poisson") = defaults.poisson, py::arg("density") = defaults.density,
             py::arg("rayleigh_mass") = defaults.rayleigh_mass,
             py::arg("rayleigh_stiffness") = defaults.rayleigh_stiffness, py::arg("law") = "corotated",
             "young: Pa; density: kg/m3; rayleigh_mass: 1/s; rayleigh_stiffness: s; law: corotated, "
             "stable_neo_hookean or st_venant_kirchhoff.")
        .def_readonly("young", &Material::young)
        .def_readonly("poisson", &Material::poisson)
        .def_readonly("density", &Material::density)
        .def_readonly("rayleigh_mass", &Material::rayleigh_mass)
        .def_readonly("rayleigh_stiffness", &Material::rayleigh_stiffness)
        .def_property_readonly("law",
                               [](const Material& material) { return std::string(name(material.law)); })
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
            "U", [](py::object self) { return view(self.cast<const Modes&>().basis.U, self); },
            "[3 N, m] float32: x y z of node 0 first. Refers to the object.")
        .def_property_readonly(
            "frequencies",
            [](py::object self) { return view(self.cast<const Modes&>().basis.frequencies, self); },
            "[m] Hz, ascending. Refers to the object.")
        .def_property_readonly("max_residual", [](const Modes& modes) { return modes.report.max_residual; })
        .def_property_readonly("max_rigid_hz", [](const Modes& modes) { return modes.report.max_rigid_hz; });
    m.def(
        "vibration_modes",
        [](const Body& body, int count, std::uint64_t seed) {
            return stoppable(
                [&] { return vibration_modes(ElasticBody(body), {.count = count, .seed = seed}); });
        },
        py::arg("body"), py::arg("count") = 128, py::arg("seed") = 1,
        "The lowest elastic vibration modes of the free body at rest. The same seed gives the same bits.");
}

}  // namespace

void bind_bodies(py::module_& m) {
    bind_material(m);
    py::class_<Body, SharedBody>(m, "Body",
                                 "A deformable body at rest: tetrahedra, a collision surface that hangs on "
                                 "them, a material. It does not change.")
        .def_readonly("name", &Body::name)
        .def_property_readonly(
            "origin", [](py::object self) { return view(self.cast<const Body&>().origin, self); },
            "[3] metres: what its positions are counted from; zero unless the body lies far away.")
        .def_property_readonly(
            "X", [](py::object self) { return view(self.cast<const Body&>().tets.X, self); },
            "Rest positions of the tet nodes [N, 3], metres. Refers to the body.")
        .def_property_readonly(
            "T", [](py::object self) { return view(self.cast<const Body&>().tets.T, self); },
            "Tetrahedra [T, 4]. Refers to the body.")
        .def_property_readonly(
            "surface_X", [](py::object self) { return view(self.cast<const Body&>().surface.X, self); },
            "Rest positions of the collision surface [n, 3], metres. Refers to the body.")
        .def_property_readonly(
            "F", [](py::object self) { return view(self.cast<const Body&>().surface.F, self); },
            "Faces of the collision surface [m, 3]. Refers to the body.")
        .def_property_readonly(
            "tets", [](const Body& body) -> const TetMesh& { return body.tets; },
            "The tetrahedra as a TetMesh. Refers to the body.")
        .def_property_readonly(
            "surface", [](const Body& body) -> const TriMesh& { return body.surface; },
            "The collision surface as a TriMesh. Refers to the body.")
        .def_property_readonly(
            "W", [](py::object self) { return embedding_views(self.cast<const Body&>().W, self); },
            "The weights that carry nodes to the surface, (data, indices, indptr) as scipy.sparse.csr_matrix "
            "takes them, [n, N]. Refers to the body.")
        .def(
            "surface_positions",
            [](const Body& body, py::handle x) {
                const NodeRows nodes(x, "x", 3);
                nodes.expect(body.W.cols(), "x", "node");
                return owned(embedded(body.W, nodes.as<Nodes>()));
            },
            py::arg("x"), "Positions of the surface, W x, for node positions x [N, 3]. A new array.")
        .def_readonly("material", &Body::material)
        .def_property_readonly("modes", &modes_of, "None, or (U, frequencies). Refers to the body.")
        .def_property_readonly(
            "hash", [](const Body& body) { return body_hash(body); },
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
        py::arg("material") = Material{}, py::arg("levels") = 0, py::arg("scheme") = "midpoint",
        "A body of tetrahedra and a closed surface in or near them; without one, of their boundary. levels: "
        "how often the collision surface is subdivided.");
    m.def("mesh_file", &mesh_body, py::arg("path"), py::arg("nodes") = py::none(),
          py::arg("grading") = py::none(), py::arg("cage") = py::none(), py::arg("inside") = py::none(),
          py::arg("material") = py::none(), py::arg("levels") = py::none(), py::arg("scheme") = py::none(),
          py::arg("scale") = 1.0, py::arg("weld") = py::none(),
          "Makes a body from a file as `nbdtree mesh` does: a closed surface is checked and filled; with "
          "`cage`, a number of tet nodes, any triangle soup is embedded in a coarse cage. scale: of all "
          "coordinates, 0.001 for millimetres. weld: cracks up to this length, metres, are closed. Warns "
          "(UserWarning) of a body whose size, tetrahedra or Poisson's ratio may make its motion wrong.");
    m.def(
        "save_body",
        [](const path& file, const Body& body) {
            check_output(file, {});
            long_call<FileCall>([&] { save_body(file, body); });
        },
        py::arg("path"), py::arg("body"), "Writes a body file under a temporary name and renames it.");
    m.def(
        "load_body",
        [](const path& file) {
            return long_call<FileCall>([&] { return std::make_shared<Body>(load_body(file)); });
        },
        py::arg("path"), "Reads a body file.");
    bind_modes(m);
}

}  // namespace nbd::python
