#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <functional>
#include <optional>
#include <sstream>
#include <utility>
#include <vector>

#include "apps/cli/mesh_file.hpp"
#include "apps/cli/option_checks.hpp"
#include "apps/cli/output_paths.hpp"
#include "apps/commands/commands.hpp"
#include "meshing/body/body_hints.hpp"
#include "meshing/body/material.hpp"
#include "meshing/body/rigid_body.hpp"
#include "meshing/cage/cage.hpp"
#include "meshing/formats/words.hpp"
#include "meshing/tets/tet_quality.hpp"
#include "sim/fem/bending_error.hpp"
#include "sim/json/nearest_name.hpp"
#include "sim/scene/length_unit.hpp"

namespace nbd {
namespace {

struct MeshArguments {
    std::string input, output, scheme = "midpoint", law{name(MaterialLaw::corotated)}, elements, units = "m";
    std::vector<std::string> regions;
    std::vector<double> stretch;  // three factors, or none
    std::optional<double> grading;
    MeshFileConfig config;
    std::function<void()> check_options{};  // refuses those that the input takes no notice of
};

std::vector<std::string> names_of_laws() {
    std::vector<std::string> names;
    for (const MaterialLaw law : material_laws) names.emplace_back(name(law));
    return names;
}

[[noreturn]] void refuse_region(const std::string& text, const std::string& reason) {
    throw CLI::ValidationError("--region", fmt::format("\"{}\": {}", text, reason));
}

double number(const std::string& text, const std::string& value) {
    const auto result = plain_number_in<double>(value);
    if (!result || !std::isfinite(*result)) refuse_region(text, fmt::format("\"{}\" is not a number", value));
    return *result;
}

void set(MaterialChange& change, const std::string& text, const std::string& key, const std::string& value) {
    std::optional<double>* const constant = key == "young"     ? &change.young
                                            : key == "poisson" ? &change.poisson
                                            : key == "density" ? &change.density
                                                               : nullptr;
    if (!constant && key != "law")
        refuse_region(
            text,
            fmt::format("key \"{}\" is not known; allowed: young, poisson, density, law{}", key,
                        nearest_hint(key, {"young", "poisson", "density", "law"}, "; the nearest is {}")));
    if (constant ? constant->has_value() : change.law.has_value())
        refuse_region(text, fmt::format("key \"{}\" occurs twice", key));
    if (constant) {
        *constant = number(text, value);
        return;
    }
    change.law = material_law(value);
    if (!change.law)
        refuse_region(text, fmt::format("law \"{}\" is not known; allowed: {}{}", value,
                                        fmt::join(names_of_laws(), ", "),
                                        nearest_hint(value, names_of_laws(), "; the nearest is {}")));
}

/// Reads "NAME:key=value,key=value"; keys are young, poisson, density and law. Throws CLI::ValidationError
/// with what is wrong and what was allowed; ranges are checked where the material is used.
std::pair<std::string, MaterialChange> parse_region(const std::string& text) {
    const std::size_t colon = text.rfind(':');
    if (colon == text.npos || colon == 0)
        refuse_region(text, "expected NAME:key=value, such as core:young=2e6");
    MaterialChange change;
    std::istringstream parts(text.substr(colon + 1));
    for (std::string part; std::getline(parts, part, ',');) {
        const std::size_t equals = part.find('=');
        if (equals == part.npos) refuse_region(text, fmt::format("expected key=value, found \"{}\"", part));
        set(change, text, part.substr(0, equals), part.substr(equals + 1));
    }
    return {text.substr(0, colon), change};
}

nlohmann::ordered_json to_json(const CageReport& cage) {
    const SoupReport& soup = cage.soup;
    return {{"vertices", cage.vertices},
            {"faces", cage.faces},
            {"volume", cage.volume},
            {"material", cage.material},
            {"wraps_solid", !cage.why_wrapped.empty()},
            {"distance", cage.distance},
            {"alpha", cage.alpha},
            {"offset", cage.offset},
            {"closes_holes", cage.closes_holes},
            {"joins_parts", cage.joins_parts},
            {"defects",
             {{"repeating_faces", soup.repeating_faces},
              {"flat_faces", soup.flat_faces},
              {"duplicate_faces", soup.duplicate_faces},
              {"open_edges", soup.open_edges},
              {"crowded_edges", soup.crowded_edges},
              {"shells", soup.shells},
              {"unreferenced_vertices", cage.soup.dropped_vertices}}}};
}

void run(const MeshArguments& arguments, Output& out) {
    arguments.check_options();
    check_output(arguments.output, {arguments.input, arguments.config.inside}, ".h5");
    MeshFileConfig config = arguments.config;
    config.material.law = *material_law(arguments.law);
    config.scale *= metres_in(arguments.units);
    if (!arguments.stretch.empty())
        config.stretch = {arguments.stretch[0], arguments.stretch[1], arguments.stretch[2]};
    for (const std::string& text : arguments.regions) {
        const auto [group, change] = parse_region(text);
        if (!config.regions.emplace(group, change).second)
            throw CLI::ValidationError("--region", "names \"" + group + "\" twice");
    }
    if (!config.regions.empty() && !holds_tets(arguments.input))
        throw CLI::ValidationError("--region",
                                   "is for groups of tetrahedra, but " + arguments.input + " is a surface");
    config.rigid = arguments.elements == "rigid";
    if (arguments.grading) {
        config.tets.grading = *arguments.grading;
        if (!config.error) config.error = 0;
    }
    if (!arguments.elements.empty() && !config.rigid)
        config.elements = arguments.elements == "linear" ? Elements::linear : Elements::quadratic;
    config.scheme = arguments.scheme == "loop" ? SubdivisionScheme::loop : SubdivisionScheme::midpoint;
    if (config.cage > 0 && holds_tets(arguments.input))
        throw CLI::ValidationError("--cage",
                                   "goes around a surface, but " + arguments.input + " holds tetrahedra");
    if (!config.inside.empty() && holds_tets(arguments.input))
        throw CLI::ValidationError("--inside",
                                   "takes a surface, but " + arguments.input + " holds tetrahedra");
    MeshedFile meshed = mesh_file(arguments.input, config, out);
    Body& body = meshed.body;
    const TetMesh& tets = body.tets;
    const TetQuality quality = tet_quality(tets);
    out.text(to_text(quality));
    if (quality.poor > 0 && !is_rigid(tets))
        out.warning(fmt::format(
            "{} of {} tetrahedra have a radius ratio below {}, the worst is tetrahedron {} with "
            "{:.2g}; steps are stiff there, and another number of nodes may avoid them",
            quality.poor, quality.tets, poor_radius_ratio, quality.worst_tet, quality.radius_ratio_min));
    for (const std::string& hint : body_hints(body))
        out.warning(fmt::format("{}: {}", arguments.output, hint));
    if (is_rigid(tets)) {
        out.text(fmt::format("rigid, of {:.4g} kg", body.material.density * quality.volume * tets.filled(0)));
    } else {
        out.work("estimating how rightly it bends");
        constexpr int most_tets = 24'000;
        if (!body.bending_error) body.bending_error = bending_error(body, most_tets, meshed.solid_in_tets());
        out.text(
            body.bending_error
                ? fmt::format("bends {:.2g} % too little, as richer elements tell", 100 * *body.bending_error)
                : "no estimate of how rightly it bends: too many tetrahedra, several parts, or a cage of "
                  "unknown content");
    }
    save_body(arguments.output, body);

    out.text(fmt::format("{}: {} nodes, {} tetrahedra, collision surface of {} vertices and {} faces",
                         arguments.output, tets.X.rows(), tets.T.rows(), body.surface.X.rows(),
                         body.surface.F.rows()));
    nlohmann::ordered_json result = {
        {"nodes", tets.X.rows()},
        {"tets", tets.T.rows()},
        {"surface_vertices", body.surface.X.rows()},
        {"faces", body.surface.F.rows()},
        {"volume", is_rigid(tets) ? quality.volume * tets.filled(0) : quality.volume},
        {"radius_ratio_min", quality.radius_ratio_min},
        {"radius_ratio_mean", quality.radius_ratio_mean},
        {"slivers", quality.poor},
        {"slivers_optimised", meshed.optimization.poor_before - meshed.optimization.poor_after},
        {"nodes_added", meshed.optimization.nodes_added},
        {"dihedral_min", quality.dihedral_min},
        {"dihedral_max", quality.dihedral_max},
        {"body_sha256", body_hash(body)}};
    if (body.bending_error) result["bending_error"] = *body.bending_error;
    if (meshed.cage) result["cage"] = to_json(*meshed.cage);
    out.result(result);
}

/// Options of the material, which a body of its own material excludes.
std::vector<CLI::Option*> add_material_options(CLI::App& command, MeshArguments& arguments) {
    Material& material = arguments.config.material;
    return {
        command.add_option("--law", arguments.law, "How stress follows from strain")
            ->check(one_of(names_of_laws())),
        command.add_option("--young", material.young, "Young's modulus, Pa")
            ->check(between(least_constant, max_constant)),
        command.add_option("--poisson", material.poisson, "Poisson's ratio")
            ->check(between(least_poisson, max_poisson)),
        command.add_option("--density", material.density, "Density, kg/m3")
            ->check(between(least_constant, max_constant)),
        command.add_option("--rayleigh-mass", material.rayleigh_mass, "Damping of slow motion, 1/s")
            ->check(between(0, max_constant)),
        command.add_option("--rayleigh-stiffness", material.rayleigh_stiffness, "Damping of fast motion, s")
            ->check(between(0, max_constant)),
        command
            .add_option("--region", arguments.regions,
                        "Another material for a group of tetrahedra in the file, such as "
                        "core:young=2e6,law=stable_neo_hookean; may be repeated")
            ->allow_extra_args(false)};
}

/// Options of the tetrahedra that fill a surface, which a cage, and tetrahedra of another body, exclude.
std::vector<CLI::Option*> add_filling_options(CLI::App& command, MeshArguments& arguments) {
    MeshFileConfig& config = arguments.config;
    CLI::Option* const nodes =
        command
            .add_option(
                "--nodes", config.tets.nodes,
                "Target number of the corners of tetrahedra that have the surface's own triangles, met within 5 %; "
                "0: determined by --grading")
            ->check(whole_number(0, 100'000'000));
    CLI::Option* const edge =
        command
            .add_option("--edge", config.edge,
                        "How long the tetrahedra's edges are at the surface, metres (after --scale); its "
                        "triangles are then the collision surface alone")
            ->check(between(least_constant, max_constant))
            ->excludes(nodes);
    CLI::Option* const error =
        command
            .add_option("--error", config.error,
                        "Search for quadratic tetrahedra that bend with at most this "
                        "error, estimated by finer ones; default: 0.03, unless sizes or "
                        "elements are told")
            ->check(between(1e-4, 0.5))
            ->excludes(nodes)
            ->excludes(edge);
    return {nodes, edge, error,
            command
                .add_option("--grading", arguments.grading,
                            fmt::format("How fast tetrahedra grow inward; default: {}", config.tets.grading))
                ->check(between(0, 2))};
}

/// Options of the collision surface, likewise.
std::vector<CLI::Option*> add_surface_options(CLI::App& command, MeshArguments& arguments) {
    return {command
                .add_option("--subdivide", arguments.config.levels,
                            "1-to-4 subdivisions of the collision surface")
                ->check(whole_number(0, 4)),
            command.add_option("--subdivision", arguments.scheme, "midpoint keeps the shape, loop rounds it")
                ->check(one_of({"midpoint", "loop"}))};
}

/// Throws CLI::ValidationError if one of the options is given.
void refuse_any(const std::vector<CLI::Option*>& options, const std::string& why) {
    for (const CLI::Option* option : options)
        if (option->count() > 0) throw CLI::ValidationError(option->get_name(), why);
}

}  // namespace

void add_mesh(CLI::App& app, Output& out) {
    const auto [command, arguments] = add_command<MeshArguments>(
        app, out, "mesh", "Fills a closed surface with tetrahedra and writes a body file", run);
    MeshFileConfig& config = arguments.config;
    command
        .add_option(
            "SURFACE", arguments.input,
            "Surface (.obj .ply .stl .off .glb), tetrahedra made elsewhere (.msh .mesh .vtk .vtu .inp), or a "
            "body file (.h5), of which the tetrahedra and the material are taken")
        ->required();
    command.add_option("-o,--output", arguments.output, "Body file to write")->required();
    std::vector<CLI::Option*> of_filling = add_filling_options(command, arguments);
    const std::vector<CLI::Option*> of_material = add_material_options(command, arguments),
                                    of_surface = add_surface_options(command, arguments);
    command
        .add_option("--scale", config.scale,
                    "Factor of all coordinates: 0.001 for a file in millimetres, as bodies are in metres")
        ->check(between(least_constant, max_constant));
    command.add_option("--units", arguments.units, "Unit of the file's coordinates, beside --scale")
        ->check(one_of(length_unit_names()));
    command
        .add_option("--stretch", arguments.stretch, "Further factors of the coordinates, along x, y and z")
        ->expected(3)
        ->type_name("X Y Z")
        ->check(between(least_constant, max_constant));
    CLI::Option* elements =
        command
            .add_option(
                "--elements", arguments.elements,
                "Tetrahedra: linear, with nodes at their corners, or quadratic, with nodes at their "
                "edges, too, which bend rightly where they are coarse and do not lock; or rigid: no "
                "tetrahedra, a body that never deforms; default: as in the file; in a surface those of --error, or linear ones "
                "with its own triangles where --nodes or --grading is told")
            ->check(one_of({"linear", "quadratic", "rigid"}));
    CLI::Option* weld =
        command
            .add_option("--weld", config.weld,
                        "Close cracks of a surface: what lies at most this far apart becomes one, "
                        "metres (after --scale)")
            ->check(between(least_constant, max_constant));
    CLI::Option* cage =
        command
            .add_option("--cage", config.cage,
                        "Take any surface as it is, also an open or defective one, and embed it in a coarse "
                        "cage of tetrahedra with this many corners, met within 10 %")
            ->check(whole_number(min_cage_nodes, max_cage_nodes));
    CLI::Option* inside = command.add_option(
        "--inside", config.inside,
        "Take any surface as it is and embed it in the tetrahedra of this body file, with its material");
    for (const auto& options : {of_filling, of_surface})
        for (CLI::Option* option : options) {
            cage->excludes(option);
            inside->excludes(option);
        }
    for (CLI::Option* option : of_material) inside->excludes(option);
    inside->excludes(cage);
    inside->excludes(elements);
    command.get_option("--error")->excludes(elements);
    of_filling.push_back(weld);
    std::vector<CLI::Option*> not_for_rigid{cage, command.get_option("--region")};
    for (CLI::Option* option : of_filling)
        if (option != weld) not_for_rigid.push_back(option);
    for (CLI::Option* option : of_material)
        if (option->get_name() != "--density") not_for_rigid.push_back(option);
    arguments.check_options = [&input = arguments.input, &elements_kind = arguments.elements, of_material,
                               of_filling, not_for_rigid] {
        if (elements_kind == "rigid") refuse_any(not_for_rigid, "is not for a rigid body");
        if (holds_tets(input)) refuse_any(of_filling, "is for surfaces, but " + input + " holds tetrahedra");
        if (std::filesystem::path(input).extension() == ".h5")
            refuse_any(of_material, "the body file " + input + " has a material of its own");
    };
}

}  // namespace nbd
