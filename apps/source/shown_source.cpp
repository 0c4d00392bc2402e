#include "apps/source/shown_source.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <stdexcept>

#include "apps/cli/load_body.hpp"
#include "apps/cli/scene_files.hpp"
#include "apps/simulate/simulation_outputs.hpp"
#include "apps/source/pose_argument.hpp"
#include "apps/view/scene_view.hpp"
#include "meshing/h5/reader.hpp"
#include "sim/excitation/recipe.hpp"
#include "sim/world/hang_on_body.hpp"

namespace nbd {
namespace {

namespace fs = std::filesystem;

/// Folder that the paths of a recorded scene are relative to.
fs::path scene_folder(const SourceArgument& argument, const RecordingReader& recording) {
    if (fs::is_directory(argument.scene)) return argument.scene;
    if (!argument.scene.empty()) return fs::path(argument.scene).parent_path();
    return fs::path(argument.source).parent_path() /
           fs::path(recording.label(scene_file_label)).parent_path();
}

SceneSpec recorded_scene(const SourceArgument& argument, const RecordingReader& recording) {
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
        throw std::runtime_error(fmt::format("{}: no such file or folder", argument.scene));
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

/// Throws what says how a body or a tree is shown, neither of which has poses.
void refuse_without_poses(const std::string& path) {
    const std::string format = h5::Reader(path).format().name;
    if (format == "nbdtree body")
        throw std::invalid_argument(
            fmt::format("{0}: is a body, which has no poses; allowed: RECORDING.h5:trajectory --body {0}, "
                        "TREE.h5@RECORDING.h5:trajectory, or a surface file",
                        path));
    if (format == "nbdtree tree")
        throw std::invalid_argument(
            fmt::format("{0}: is a tree, which has no poses; "
                        "allowed: {0}@RECORDING.h5:trajectory, or {0}@SURFACE",
                        path));
}

ShownRecording open_scene(const SourceArgument& argument, const Output& out) {
    refuse_without_poses(argument.source);
    const auto recording = std::make_shared<const RecordingReader>(argument.source);
    const SceneSpec spec = recorded_scene(argument, *recording);
    Output silent = out;
    silent.quiet = true;
    SceneFiles files;
    std::vector<LoadedBody> bodies;
    for (const SceneBody& body : spec.bodies) bodies.push_back(files.load(body, silent));
    make_trees(spec, bodies);
    ShownRecording shown = shown_scene(recording, spec, bodies, argument.frames);
    shown.inputs = scene_inputs(spec);
    return shown;
}

/// A body of its own in the poses of a recording, or in one of a file.
struct Subject {
    ViewSource source;
    std::string hash;   // body_hash() of the body
    std::string whose;  // for messages
};

Subject subject_of(const SourceArgument& argument, const std::string& tree) {
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
    ViewTree& shown = subject.source.tree;
    if (!argument.bounds.empty()) shown.bounds = bound_kind(argument.bounds);
    if (argument.margin) shown.margin = static_cast<float>(*argument.margin);
    if (tree.empty()) {
        CollisionTree own = make_exact_tree(body->surface.X.cast<float>(), body->surface.F);
        if (reads_nodes(shown.bounds)) hang_on_body(own, *body, argument.body);
        shown.tree = std::make_shared<const CollisionTree>(std::move(own));
        shown.W = body->float_weights();
        subject.source.rest = body->surface.X.cast<float>();
        return subject;
    }
    TreeFile file = body ? load_tree_of(argument.body, subject.hash, tree) : load_tree(tree);
    subject.hash = file.facts.body_hash;
    subject.whose = "the tree's";
    if (subject.source.name.empty()) subject.source.name = fs::path(tree).stem().string();
    if (file.tree.affine) subject.source.start = file.tree.affine->rest();
    subject.source.rest = std::move(file.X);
    if (!file.tree.affine && subject.source.start.rows() > 0 && reads_nodes(shown.bounds))
        hang_on_nodes(file.tree, file.W, subject.source.start);
    shown.tree = std::make_shared<const CollisionTree>(std::move(file.tree));
    shown.W = std::move(file.W);
    return subject;
}

ShownRecording open_frames(const SourceArgument& argument, const std::string& tree,
                           const RecordedFrames& frames) {
    Subject subject = subject_of(argument, tree);
    const auto recording = std::make_shared<const RecordingReader>(frames.path);
    const int trajectory = find_frames(*recording, frames, subject.hash, subject.whose);
    const TrajectoryInfo& info = recording->trajectories()[trajectory];
    ShownRecording shown;
    shown.origin = recording->origin();
    ViewScene& scene = shown.scene;
    scene.title = fs::path(argument.source).filename().string() + from_origin(recording->origin());
    scene.displacement_from = "rest";
    scene.recorded_frames = info.frames;
    scene.numbers =
        frames.frame ? std::vector{*frames.frame} : even_frames(scene.recorded_frames, argument.frames);
    const std::vector<double> times = recording->times(trajectory);
    for (const int number : scene.numbers) scene.times.push_back(times[number]);
    ViewSources& sources = shown.sources;
    subject.source.has_forces = recording->has(trajectory, FrameField::contact_forces);
    sources.bodies.push_back(std::move(subject.source));
    try {
        sources.obstacles = recipe_obstacles(info.recipe.str());
    } catch (const std::invalid_argument& error) {
        throw std::runtime_error(
            fmt::format("{}: trajectory {}: {}", frames.path, frames.trajectory, error.what()));
    }
    sources.read_nodes = [recording, trajectory](int, int frame, Vertices& x) {
        recording->read(trajectory, frame, 1, x);
    };
    sources.read_forces = [recording, trajectory](int, int frame, Vertices& x) {
        recording->read_field(trajectory, FrameField::contact_forces, frame, 1, x);
    };
    return shown;
}

/// The parts of TREE.h5@POSE; the first is empty without '@'.
struct TreeAndPose {
    std::string tree, pose;
};

TreeAndPose parts_of(const std::string& source) {
    const std::size_t at = source.find('@');
    if (at == std::string::npos) return {"", source};
    return {source.substr(0, at), source.substr(at + 1)};
}

}  // namespace

std::vector<fs::path> files_of(const SourceArgument& argument) {
    std::vector<fs::path> files{argument.source, argument.body, argument.scene};
    const auto [tree, pose] = parts_of(argument.source);
    for (const std::string& file : {tree, pose}) files.emplace_back(file);
    if (const auto frames = recorded_frames(pose)) files.emplace_back(frames->path);
    return files;
}

bool names_recording(const SourceArgument& argument) {
    const auto [tree, pose] = parts_of(argument.source);
    const bool names_frames = recorded_frames(pose).has_value();
    if (names_frames && tree.empty() && argument.body.empty())
        throw std::invalid_argument(
            fmt::format("{}: a trajectory alone does not have a surface; allowed: with --body, or TREE.h5@{}",
                        argument.source, argument.source));
    if (!names_frames && !argument.body.empty())
        throw std::invalid_argument(
            fmt::format("--body: is for RECORDING.h5:trajectory, but {} names none", argument.source));
    return names_frames || (tree.empty() && fs::path(pose).extension() == ".h5");
}

ShownRecording open_recording(const SourceArgument& argument, const Output& out) {
    const auto [tree, pose] = parts_of(argument.source);
    if (const auto frames = recorded_frames(pose)) return open_frames(argument, tree, *frames);
    return open_scene(argument, out);
}

ViewScene view_of_surface(const SourceArgument& argument) {
    const BoundKind bounds = argument.bounds.empty() ? BoundKind::boxes : bound_kind(argument.bounds);
    const std::string name = fs::path(argument.source).filename().string();
    std::optional<float> margin;
    if (argument.margin) margin = static_cast<float>(*argument.margin);
    const PoseArgument posed = read_pose(argument.source, bounds);
    check_model_of({&posed}, bounds, margin.has_value());
    const std::string title = name + from_origin(posed.origin);
    return view_of_surfaces({view_source(name, posed, bounds, margin)}, {posed.x}, title, 0);
}

}  // namespace nbd
