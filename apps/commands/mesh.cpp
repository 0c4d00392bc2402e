#include <fmt/core.h>

#include <filesystem>
#include <memory>
#include <vector>

#include "apps/cli/mesh_file.hpp"
#include "apps/cli/option_checks.hpp"
#include "apps/cli/output_paths.hpp"
#include "apps/cli/region_option.hpp"
#include "apps/commands/commands.hpp"
#include "meshing/body/body_hints.hpp"
#include "meshing/body/constant_range.hpp"
#include "meshing/cage/cage.hpp"
#include "meshing/tets/tet_quality.hpp"

namespace nbd {
namespace {

struct MeshArguments {
    std::string input, output, scheme = "midpoint", law{name(MaterialLaw::corotated)};
    std::vector<std::string> regions;
    MeshFileConfig config;
};

nlohmann::ordered_json to_json(const CageReport& cage) {
    const SoupReport& soup = cage.soup.given;
    return {{"vertices", cage.vertices},
            {"faces", cage.faces},
            {"volume", cage.volume},
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
    check_output(arguments.output, {arguments.input, arguments.config.inside}, ".h5");
    MeshFileConfig config = arguments.config;
    config.material.law = *material_law(arguments.law);
    for (const std::string& text : arguments.regions) {
        const auto [group, change] = parse_region(text);
        if (!config.regions.emplace(group, change).second)
            throw CLI::ValidationError("--region", "names \"" + group + "\" twice");
    }
    if (!config.regions.empty() && !holds_tets(arguments.input))
        throw CLI::ValidationError("--region",
                                   "is for groups of tetrahedra, but " + arguments.input + " is a surface");
    config.scheme = arguments.scheme == "loop" ? SubdivisionScheme::loop : SubdivisionScheme::midpoint;
    if (config.cage > 0 && holds_tets(arguments.input))
        throw CLI::ValidationError("--cage",
                                   "goes around a surface, but " + arguments.input + " holds tetrahedra");
    if (!config.inside.empty() && holds_tets(arguments.input))
        throw CLI::ValidationError("--inside",
                                   "takes a surface, but " + arguments.input + " holds tetrahedra");
    const MeshedFile meshed = mesh_file(arguments.input, config, out);
    const Body& body = meshed.body;
    const TetMesh& tets = body.tets;
    const TetQuality quality = tet_quality(tets);
    out.text(to_text(quality));
    if (quality.poor > 0)
        out.warning(fmt::format(
            "{} of {} tetrahedra have a radius ratio below {}, the worst is tetrahedron {} with "
            "{:.2g}; steps are stiff there, and another number of nodes may avoid them",
            quality.poor, quality.tets, poor_radius_ratio, quality.worst_tet, quality.radius_ratio_min));
    for (const std::string& hint : body_hints(body))
        out.warning(fmt::format("{}: {}", arguments.output, hint));
    save_body(arguments.output, body);

    out.text(fmt::format("{}: {} nodes, {} tetrahedra, collision surface of {} vertices and {} faces",
                         arguments.output, tets.X.rows(), tets.T.rows(), body.surface.X.rows(),
                         body.surface.F.rows()));
    nlohmann::ordered_json result = {
        {"nodes", tets.X.rows()},
        {"tets", tets.T.rows()},
        {"surface_vertices", body.surface.X.rows()},
        {"faces", body.surface.F.rows()},
        {"volume", quality.volume},
        {"radius_ratio_min", quality.radius_ratio_min},
        {"radius_ratio_mean", quality.radius_ratio_mean},
        {"slivers", quality.poor},
        {"slivers_optimised", meshed.optimization.poor_before - meshed.optimization.poor_after},
        {"nodes_added", meshed.optimization.nodes_added},
        {"dihedral_min", quality.dihedral_min},
        {"dihedral_max", quality.dihedral_max},
        {"body_sha256", body_hash(body)}};
    if (meshed.cage) result["cage"] = to_json(*meshed.cage);
    out.result(result);
}

}  // namespace

void add_mesh(CLI::App& app, Output& out) {
    auto arguments = std::make_shared<MeshArguments>();
    Material& material = arguments->config.material;
    CLI::App* command =
        app.add_subcommand("mesh", "Fills a closed surface with tetrahedra and writes a body file");
    command
        ->add_option(
            "SURFACE", arguments->input,
            "Surface (.obj .ply .stl .off .glb), tetrahedra made elsewhere (.msh .vtk .vtu .mesh), or a "
            "body file (.h5), of which the tetrahedra and the material are taken")
        ->required();
    command->add_option("-o,--output", arguments->output, "Body file to write")->required();
    CLI::Option* nodes =
        command
            ->add_option("--nodes", arguments->config.tets.nodes,
                         "Target number of tet nodes, met within 5 %; 0: determined by --grading")
            ->capture_default_str()
            ->check(whole_number(0, 100'000'000));
    CLI::Option* grading =
        command->add_option("--grading", arguments->config.tets.grading, "How fast tetrahedra grow inward")
            ->capture_default_str()
            ->check(between(0, 2));
    const std::vector<CLI::Option*> of_material = {
        command->add_option("--law", arguments->law, "How stress follows from strain")
            ->capture_default_str()
            ->check(one_of(names_of_laws())),
        command->add_option("--young", material.young, "Young's modulus, Pa")
            ->capture_default_str()
            ->check(between(least_constant, max_constant)),
        command->add_option("--poisson", material.poisson, "Poisson's ratio")
            ->capture_default_str()
            ->check(between(least_poisson, max_poisson)),
        command->add_option("--density", material.density, "Density, kg/m3")
            ->capture_default_str()
            ->check(between(least_constant, max_constant)),
        command->add_option("--rayleigh-mass", material.rayleigh_mass, "Damping of slow motion, 1/s")
            ->capture_default_str()
            ->check(between(0, max_constant)),
        command->add_option("--rayleigh-stiffness", material.rayleigh_stiffness, "Damping of fast motion, s")
            ->capture_default_str()
            ->check(between(0, max_constant)),
        command
            ->add_option("--region", arguments->regions,
                         "Another material for a group of tetrahedra in the file, such as "
                         "core:young=2e6,law=stable_neo_hookean; may be repeated")
            ->allow_extra_args(false)};
    CLI::Option* subdivide = command
                                 ->add_option("--subdivide", arguments->config.levels,
                                              "1-to-4 subdivisions of the collision surface")
                                 ->capture_default_str()
                                 ->check(whole_number(0, 4));
    CLI::Option* subdivision =
        command->add_option("--subdivision", arguments->scheme, "midpoint keeps the shape, loop rounds it")
            ->capture_default_str()
            ->check(one_of({"midpoint", "loop"}));
    command
        ->add_option("--scale", arguments->config.scale,
                     "Factor of all coordinates: 0.001 for a file in millimetres, as bodies are in metres")
        ->capture_default_str()
        ->check(between(least_constant, max_constant));
    CLI::Option* weld =
        command
            ->add_option("--weld", arguments->config.weld,
                         "Close cracks of a surface: what lies at most this far apart becomes one, "
                         "metres (after --scale)")
            ->check(between(least_constant, max_constant));
    CLI::Option* cage =
        command
            ->add_option("--cage", arguments->config.cage,
                         "Take any surface as it is, also an open or defective one, and embed it in a coarse "
                         "cage of this many tet nodes, met within 10 %")
            ->check(whole_number(min_cage_nodes, max_cage_nodes));
    CLI::Option* inside = command->add_option(
        "--inside", arguments->config.inside,
        "Take any surface as it is and embed it in the tetrahedra of this body file, with its material");
    for (CLI::Option* other : {nodes, grading, subdivide, subdivision}) {
        cage->excludes(other);
        inside->excludes(other);
    }
    for (CLI::Option* other : of_material) inside->excludes(other);
    inside->excludes(cage);
    command->final_callback([arguments, of_material, of_filling = std::vector{nodes, grading, weld}, &out] {
        if (holds_tets(arguments->input))
            for (const CLI::Option* option : of_filling)
                if (option->count() > 0)
                    throw CLI::ValidationError(
                        option->get_name(), "is for surfaces, but " + arguments->input + " holds tetrahedra");
        if (std::filesystem::path(arguments->input).extension() == ".h5")
            for (const CLI::Option* option : of_material)
                if (option->count() > 0)
                    throw CLI::ValidationError(option->get_name(), "the body file " + arguments->input +
                                                                       " has a material of its own");
        run(*arguments, out);
    });
}

}  // namespace nbd
