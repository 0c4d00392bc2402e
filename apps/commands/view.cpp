#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <optional>
#include <stdexcept>

#include "apps/cli/load_body.hpp"
#include "apps/cli/option_checks.hpp"
#include "apps/cli/output_paths.hpp"
#include "apps/commands/commands.hpp"
#include "apps/commands/pose_argument.hpp"
#include "apps/simulate/scene_files.hpp"
#include "apps/simulate/simulation_outputs.hpp"
#include "apps/view/make_view.hpp"
#include "apps/view/page.hpp"
#include "apps/view/scene_view.hpp"
#include "collision/base/stopwatch.hpp"
#include "meshing/h5/atomic_file.hpp"
#include "meshing/surface/counted.hpp"

namespace nbd {
namespace {

/// What `view` is asked to show.
struct ViewArgument {
    std::string source;
    std::string scene;   // file or folder of the scene; empty: as the recording names it
    std::string body;    // body file of a trajectory; empty: none
    std::string bounds;  // of all bodies; empty: those of the scene
    std::optional<double> margin{};
    int frames = 300;  // most to be shown
};

struct ViewArguments {
    ViewArgument shown;
    std::string output;
};

namespace fs = std::filesystem;

/// Folder that the paths of a recorded scene are relative to.
fs::path scene_folder(const ViewArgument& argument, const RecordingReader& recording) {
    if (fs::is_directory(argument.scene)) return argument.scene;
    if (!argument.scene.empty()) return fs::path(argument.scene).parent_path();
    return fs::path(argument.source).parent_path() /
           fs::path(recording.label(scene_file_label)).parent_path();
}

SceneSpec recorded_scene(const ViewArgument& argument, const RecordingReader& recording) {
    if (recording.trajectories().empty())
        throw std::runtime_error(fmt::format("{}: has no trajectories", argument.source));
    const std::string& recipe = recording.trajectories().front().recipe;
    const auto json = nlohmann::json::parse(recipe, nullptr, false);
    if (!json.is_object() || !json.contains("bodies"))
        throw std::invalid_argument(
            fmt::format("{}: is not the recording of a scene; allowed: {}:{} with --body, or TREE.h5@{}:{}",
                        argument.source, argument.source, recording.trajectories().front().id,
                        argument.source, recording.trajectories().front().id));
    if (!argument.scene.empty() && !fs::exists(argument.scene))
        throw std::runtime_error(fmt::format("{}: there is no such file or folder", argument.scene));
    SceneSpec spec = parse_scene(recipe, scene_folder(argument, recording));
    for (const fs::path& file : scene_inputs(spec))
        if (!fs::exists(file))
            throw std::runtime_error(fmt::format(
                "{}: its scene needs {}, which is not there; --scene says where the scene file is",
                argument.source, file.lexically_normal().string()));
    for (SceneBody& body : spec.bodies) {
        if (!argument.bounds.empty()) body.bounds = bound_kind(argument.bounds);
        if (argument.margin) body.margin = argument.margin;
    }
    return spec;
}

ViewScene read_scene_recording(const ViewArgument& argument, Output& out) {
    const RecordingReader recording(argument.source);
    const SceneSpec spec = recorded_scene(argument, recording);
    Output silent = out;
    silent.quiet = true;
    SceneFiles files;
    std::vector<LoadedBody> bodies;
    for (const SceneBody& body : spec.bodies) bodies.push_back(files.load(body, silent));
    make_trees(spec, bodies);
    return view_of_scene(recording, spec, bodies, argument.frames,
                         [&](int done, int total) { out.progress("frames", done, total); });
}

/// A body of its own in the poses of a recording, or in one of a file.
struct Subject {
    ViewSource source;
    std::string hash;   // body_hash() of the body
    std::string whose;  // for messages
};

Subject subject_of(const ViewArgument& argument, const std::string& tree) {
    Subject subject;
    std::optional<Body> body;
    if (!argument.body.empty()) {
        body = load_body(argument.body);
        subject.hash = body_hash(*body);
        subject.whose = argument.body;
        subject.source.name = body->name;
        subject.source.start = body->tets.X.cast<float>();
        subject.source.elastic = std::make_shared<const ElasticBody>(*body);
    }
    BodyTree& shown = subject.source.tree;
    if (!argument.bounds.empty()) shown.bounds = bound_kind(argument.bounds);
    if (argument.margin) shown.margin = static_cast<float>(*argument.margin);
    if (tree.empty()) {
        shown.tree = shared_exact_tree(body->surface.X.cast<float>(), body->surface.F);
        shown.W = body->W.cast<float>();
        shown.solid = body->tets;
        return subject;
    }
    TreeFile file = body ? load_tree_of(argument.body, subject.hash, tree) : load_tree(tree);
    subject.hash = file.facts.body_hash;
    subject.whose = "the tree's";
    if (subject.source.name.empty()) subject.source.name = fs::path(tree).stem().string();
    if (file.solid.X.rows() == file.W.cols()) subject.source.start = file.solid.X.cast<float>();
    shown.tree = std::make_shared<const CollisionTree>(std::move(file.tree));
    shown.W = std::move(file.W);
    shown.solid = std::move(file.solid);
    return subject;
}

ViewScene view_of_frames(const ViewArgument& argument, const std::string& tree, const RecordedFrames& frames,
                         Output& out) {
    Subject subject = subject_of(argument, tree);
    const RecordingReader recording(frames.path);
    const int trajectory = find_frames(recording, frames, subject.hash, subject.whose);
    ViewScene scene;
    scene.title = fs::path(argument.source).filename().string();
    scene.displacement_from = "rest";
    scene.recorded_frames = recording.trajectories()[static_cast<std::size_t>(trajectory)].frames;
    if (scene.recorded_frames == 0)
        throw std::runtime_error(
            fmt::format("{}: trajectory {} has no frames", frames.path, frames.trajectory));
    scene.numbers =
        frames.frame ? std::vector{*frames.frame} : even_frames(scene.recorded_frames, argument.frames);
    const std::vector<double> times = recording.times(trajectory);
    for (const int number : scene.numbers) scene.times.push_back(times[static_cast<std::size_t>(number)]);
    ViewSources sources;
    subject.source.has_forces = recording.has(trajectory, FrameField::contact_forces);
    sources.bodies.push_back(std::move(subject.source));
    sources.read_nodes = [&](int, int frame, Vertices& x) { recording.read(trajectory, frame, 1, x); };
    sources.read_forces = [&](int, int frame, Vertices& x) {
        recording.read_field(trajectory, FrameField::contact_forces, frame, 1, x);
    };
    sources.progress = [&](int done, int total) { out.progress("frames", done, total); };
    make_view(sources, scene);
    return scene;
}

/// Shows one pose of a surface: SURFACE, or TREE.h5@SURFACE.
ViewScene view_of_surface(const ViewArgument& argument) {
    const BoundKind bounds = argument.bounds.empty() ? BoundKind::boxes : bound_kind(argument.bounds);
    const std::string name = fs::path(argument.source).filename().string();
    std::optional<float> margin;
    if (argument.margin) margin = static_cast<float>(*argument.margin);
    return view_of_surfaces({shown_surface(name, read_pose(argument.source, bounds), bounds, margin)}, name,
                            0);
}

/// The files that a source names.
std::vector<std::string> files_of(const ViewArgument& argument) {
    std::vector<std::string> files{argument.source, argument.body, argument.scene};
    std::string pose = argument.source;
    if (const std::size_t at = pose.find('@'); at != std::string::npos) {
        files.push_back(pose.substr(0, at));
        pose = pose.substr(at + 1);
        files.push_back(pose);
    }
    if (const auto frames = recorded_frames(pose)) files.push_back(frames->path);
    return files;
}

/// Reads what the argument names. Throws one line that names the wrong part.
ViewScene read_view(const ViewArgument& argument, Output& out) {
    const std::size_t at = argument.source.find('@');
    const std::string tree = at == std::string::npos ? "" : argument.source.substr(0, at);
    const std::string pose = at == std::string::npos ? argument.source : argument.source.substr(at + 1);
    const std::optional<RecordedFrames> frames = recorded_frames(pose);
    if (frames && tree.empty() && argument.body.empty())
        throw std::invalid_argument(
            fmt::format("{}: a trajectory alone does not have a surface; allowed: with --body, or TREE.h5@{}",
                        argument.source, argument.source));
    if (frames) return view_of_frames(argument, tree, *frames, out);
    if (!argument.body.empty())
        throw std::invalid_argument(
            fmt::format("--body: is for RECORDING.h5:trajectory, but {} names none", argument.source));
    if (tree.empty() && fs::path(pose).extension() == ".h5") return read_scene_recording(argument, out);
    return view_of_surface(argument);
}

/// The most face pairs of a kind in one frame.
std::uint32_t most(const ViewScene& scene, std::uint32_t PairCounts::*count) {
    std::uint32_t result = 0;
    for (const PairCounts& frame : scene.pairs) result = std::max(result, frame.*count);
    return result;
}

long sum(const ViewScene& scene, std::uint32_t PairCounts::*count) {
    long result = 0;
    for (const PairCounts& frame : scene.pairs) result += frame.*count;
    return result;
}

void tell(const ViewArguments& arguments, const ViewScene& scene, double seconds, Output& out) {
    const auto bytes = std::filesystem::file_size(arguments.output);
    long faces = 0;
    for (const ViewBody& body : scene.bodies) faces += body.F.rows();
    const std::string of = static_cast<int>(scene.frames()) < scene.recorded_frames
                               ? fmt::format(" of {}", scene.recorded_frames)
                               : "";
    out.text(fmt::format("{}: {}{}, {}, {} faces; {:.2f} MB, {:.1f} s", arguments.output,
                         counted(scene.frames(), "frame"), of, counted(scene.bodies.size(), "body", "bodies"),
                         faces, 1e-6 * static_cast<double>(bytes), seconds));
    const long missed = sum(scene, &PairCounts::intersecting_missed),
               near_missed = sum(scene, &PairCounts::near_missed);
    if (scene.is_audited)
        out.text(
            fmt::format("audit of all frames: {} of {} touching face pairs missed, {} of {} within {:.3g} m",
                        missed, sum(scene, &PairCounts::intersecting), near_missed,
                        sum(scene, &PairCounts::near), scene.contact_distance));
    out.result({{"page", arguments.output},
                {"frames", scene.frames()},
                {"recorded_frames", scene.recorded_frames},
                {"bodies", scene.bodies.size()},
                {"faces", faces},
                {"bytes", bytes},
                {"seconds", seconds},
                {"contact_distance", scene.contact_distance},
                {"most_intersecting_pairs", most(scene, &PairCounts::intersecting)},
                {"most_near_pairs", most(scene, &PairCounts::near)},
                {"audited", scene.is_audited},
                {"intersecting_pairs_missed", missed},
                {"near_pairs_missed", near_missed}});
}

void run(const ViewArguments& arguments, Output& out) {
    const Stopwatch watch;
    const std::vector<std::string> inputs = files_of(arguments.shown);
    check_output(arguments.output, {inputs.begin(), inputs.end()});
    out.work("reading");
    const ViewScene scene = read_view(arguments.shown, out);
    out.work("writing the page");
    h5::AtomicFile file(arguments.output);
    write_page(file.out(), scene);
    file.commit();
    tell(arguments, scene, 1e-6 * watch.microseconds(), out);
}

}  // namespace

void add_view(CLI::App& app, Output& out) {
    auto arguments = std::make_shared<ViewArguments>();
    CLI::App* command = app.add_subcommand("view", "Writes a page that shows a recording in a browser");
    command->footer(
        "SOURCE: the recording of a scene; RECORDING.h5:trajectory with --body, or "
        "TREE.h5@RECORDING.h5:trajectory,\n"
        "each with :frame for one pose; TREE.h5@SURFACE; or a surface file. The page is one file that "
        "fetches "
        "nothing.\n"
        "In the page, ? lists the keys.");
    ViewArgument& shown = arguments->shown;
    command->add_option("SOURCE", shown.source, "What to show, see below")->required();
    command->add_option("-o,--output", arguments->output, "Page to write (HTML)")->required();
    command->add_option("--frames", shown.frames, "Most frames to show, evenly spread over all")
        ->capture_default_str()
        ->check(CLI::Range(1, 100'000));
    command->add_option("--scene", shown.scene,
                        "Scene file, or its folder, of a recording that was moved away from it");
    command->add_option("--body", shown.body,
                        "Body file of RECORDING.h5:trajectory; with it, stress is shown");
    command->add_option("--bounds", shown.bounds, "Bounds to draw and to audit, instead of the scene's")
        ->check(bounds_name());
    command
        ->add_option("--margin", shown.margin, "Share added to these bounds' radii, instead of the scene's")
        ->check(between(0, 10));
    command->final_callback([arguments, &out] { run(*arguments, out); });
}

}  // namespace nbd
