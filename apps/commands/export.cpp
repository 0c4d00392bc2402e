#include <fmt/core.h>

#include "apps/cli/option_checks.hpp"
#include "apps/cli/output_paths.hpp"
#include "apps/clip/clip.hpp"
#include "apps/commands/commands.hpp"
#include "apps/simulate/simulation_outputs.hpp"
#include "apps/source/shown_source.hpp"
#include "collision/flat/flat_tree.hpp"
#include "meshing/formats/write_surface.hpp"
#include "meshing/h5/atomic_file.hpp"
#include "meshing/surface/counted.hpp"
#include "training/files/tree_file.hpp"

namespace nbd {
namespace {

namespace fs = std::filesystem;

struct ExportArguments {
    SourceArgument source;  // of a clip; else its first member is the tree
    std::string flat, gltf, mdd, pc2;
    bool is_flat = false;
};

void write_flat(const std::string& path, const CollisionTree& tree, Output& out) {
    save_flat_tree(path, tree);
    const std::uintmax_t bytes = fs::file_size(path);
    out.text(
        fmt::format("{}: the collision tree of {} faces, {} bytes; collision/flat/flat_tree.hpp loads it",
                    path, tree.faces.rows(), bytes));
    out.result({{"faces", tree.faces.rows()}, {"bytes", bytes}});
}

void export_tree(const ExportArguments& arguments, Output& out) {
    check_output(arguments.flat, {arguments.source.source}, ".nbd");
    out.work("exporting");
    write_flat(arguments.flat, load_tree(arguments.source.source).tree, out);
}

/// The surfaces of a recording in its frames. shown: must outlive the clip.
Clip clip_of(const ShownRecording& shown) {
    Clip clip{.title = shown.scene.title,
              .up = shown.scene.up,
              .origin = shown.recording->origin(),
              .times = shown.scene.times,
              .bodies = {},
              .read = {}};
    for (const ViewSource& source : shown.sources.bodies)
        clip.bodies.push_back({source.name, source.tree.tree->faces, source.tree.tree->vertex_count});
    clip.read = [&shown, nodes = Vertices()](int body, int frame, Vertices& x) mutable {
        shown.read_nodes(body, frame, nodes);
        apply_embedding(shown.sources.bodies[body].tree.W, nodes, x);
    };
    return clip;
}

/// Path of a file for one body: as asked for a single one, else with its number and name.
fs::path body_path(const fs::path& asked, const Clip& clip, std::size_t body) {
    if (clip.bodies.size() == 1) return asked;
    return asked.parent_path() / fmt::format("{}_{}{}", asked.stem().string(),
                                             body_file_name(body, clip.bodies[body].name),
                                             asked.extension().string());
}

/// Writes a file by what `write` puts into its stream.
template <class Write>
void write_file(const fs::path& path, const Write& write) {
    h5::AtomicFile file(path);
    write(file.out());
    file.commit();
}

/// Writes a point cache and the surface at rest for each body. Returns their paths.
std::vector<fs::path> write_caches(const fs::path& asked, const ShownRecording& shown, const Clip& clip,
                                   const std::vector<fs::path>& inputs,
                                   void (*write)(std::ostream&, const Clip&, int)) {
    std::vector<fs::path> written;
    for (std::size_t b = 0; b < clip.bodies.size(); ++b) {
        const fs::path cache = body_path(asked, clip, b);
        const fs::path surface = cache.parent_path() / fmt::format("{}_rest.obj", cache.stem().string());
        for (const fs::path& path : {cache, surface}) check_output(path, inputs);
        written.insert(written.end(), {cache, surface});
    }
    for (std::size_t b = 0; b < clip.bodies.size(); ++b) {
        write_file(written[2 * b], [&](std::ostream& out) { write(out, clip, static_cast<int>(b)); });
        write_surface(written[2 * b + 1], shown.sources.bodies[b].rest.cast<double>(), clip.bodies[b].F);
    }
    return written;
}

void export_clip(const ExportArguments& arguments, Output& out) {
    const std::string& asked = !arguments.gltf.empty()  ? arguments.gltf
                               : !arguments.mdd.empty() ? arguments.mdd
                                                        : arguments.pc2;
    std::vector<fs::path> inputs = files_of(arguments.source);
    check_output(asked, inputs, !arguments.gltf.empty() ? ".glb" : !arguments.mdd.empty() ? ".mdd" : ".pc2");
    if (!names_recording(arguments.source))
        throw std::invalid_argument(
            fmt::format("{}: is not a recording; allowed: RECORDING.h5, RECORDING.h5:trajectory with --body, "
                        "or TREE.h5@RECORDING.h5:trajectory",
                        arguments.source.source));
    const ShownRecording shown = open_recording(arguments.source, out);
    inputs.insert(inputs.end(), shown.inputs.begin(), shown.inputs.end());
    const Clip clip = clip_of(shown);
    std::vector<fs::path> written;
    if (!arguments.gltf.empty()) {
        check_output(asked, inputs);
        write_file(asked, [&](std::ostream& file) { write_glb(file, clip); });
        written = {asked};
    } else {
        if (!clip.origin.isZero(0))
            out.text(fmt::format("point caches hold float32: positions are counted from ({}, {}, {})",
                                 clip.origin.x(), clip.origin.y(), clip.origin.z()));
        written = write_caches(asked, shown, clip, inputs, arguments.mdd.empty() ? write_pc2 : write_mdd);
    }
    nlohmann::ordered_json names = nlohmann::ordered_json::array();
    for (const fs::path& path : written) {
        out.text(fmt::format("{}: {}, {:.2f} MB", path.string(), counted(clip.frames(), "frame"),
                             1e-6 * static_cast<double>(fs::file_size(path))));
        names.push_back(path.string());
    }
    out.result({{"frames", clip.frames()}, {"bodies", clip.bodies.size()}, {"files", std::move(names)}});
}

void run(const ExportArguments& arguments, Output& out) {
    if (arguments.is_flat)
        export_tree(arguments, out);
    else
        export_clip(arguments, out);
}

}  // namespace

void add_export(CLI::App& app, Output& out) {
    const auto [command, arguments] = add_command<ExportArguments>(
        app, out, "export", "Writes a tree, or the surfaces of a recording, for other programs", run);
    SourceArgument& source = arguments.source;
    source.frames = std::numeric_limits<int>::max();
    command
        .add_option("SOURCE", source.source,
                    "Tree file; or a recording, or a trajectory of one, as `view` takes it")
        ->required();
    CLI::Option_group* form = command.add_option_group("form");
    CLI::Option* flat = form->add_flag("--flat", arguments.is_flat,
                                       "Write the whole tree as one file of plain arrays, for programs "
                                       "that embed nbd::collision (see collision/flat)");
    form->add_option(
        "--gltf", arguments.gltf,
        fmt::format("Binary glTF to write (.glb), with a morph target for each of at most {} frames",
                    most_glb_frames));
    form->add_option("--mdd", arguments.mdd,
                     "Point cache to write (.mdd), and beside it the surface at rest (NAME_rest.obj)");
    form->add_option("--pc2", arguments.pc2, "Likewise (.pc2)");
    form->require_option(1);
    flat->needs(
        command.add_option("-o,--output", arguments.flat, "Flat file to write, TREE.nbd")->needs(flat));
    std::vector<CLI::Option*> of_clips{
        command
            .add_option("--frames", source.frames,
                        "Frames of a recording to write, evenly spread; default: all")
            ->check(whole_number(1, 10'000'000)),
        command.add_option("--body", source.body, "Body file of RECORDING.h5:trajectory"),
        command.add_option("--scene", source.scene,
                           "Scene file, or its folder, of a recording that was moved away from it")};
    for (CLI::Option* option : of_clips) option->excludes(flat);
}

}  // namespace nbd
