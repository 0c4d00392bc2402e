#include "apps/source/shown_source.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <span>
#include <stdexcept>
#include <utility>

#include "apps/cli/load_body.hpp"
#include "apps/simulate/simulation_outputs.hpp"
#include "apps/source/pose_argument.hpp"
#include "meshing/h5/reader.hpp"
#include "meshing/progress/progress.hpp"
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

void check_bodies(const RecordingReader& recording, const SceneSpec& spec,
                  std::span<const LoadedBody> bodies) {
    const auto refuse = [&](const std::string& what) {
        throw std::runtime_error(fmt::format("{}: {}", recording.path().string(), what));
    };
    const auto& trajectories = recording.trajectories();
    if (trajectories.size() != bodies.size())
        refuse(fmt::format("has {} trajectories, but its scene has {} bodies", trajectories.size(),
                           bodies.size()));
    for (std::size_t b = 0; b < bodies.size(); ++b) {
        if (trajectories[b].body_hash != body_hash(*bodies[b].body))
            refuse(fmt::format("body {} '{}' was recorded from another body than {}", b, spec.bodies[b].name,
                               spec.bodies[b].file.string()));
        if (trajectories[b].frames == 0) refuse("has no frames");
    }
}

/// Lets a page show these frames of a recording, whose trajectory `first` + b is that of body b.
void show_frames(std::shared_ptr<const RecordingReader> recording, int first, std::vector<int> numbers,
                 ShownRecording& shown) {
    shown.scene.numbers = std::move(numbers);
    const std::vector<double> times = recording->times(first);
    for (const int number : shown.scene.numbers) shown.scene.times.push_back(times[number]);
    for (int b = 0; b < std::ssize(shown.sources.bodies); ++b)
        shown.sources.bodies[b].has_forces = recording->has(first + b, FrameField::contact_forces);
    shown.recording = std::move(recording);
    shown.first = first;
}

/// A recording of a scene, with as many frames as all of its bodies have.
ShownRecording open_scene(const SourceArgument& argument, const Output& out) {
    refuse_without_poses(argument.source);
    const auto recording = std::make_shared<const RecordingReader>(argument.source);
    SceneSpec spec = recorded_scene(argument, *recording);
    Output silent = out;
    silent.quiet = true;
    std::vector<LoadedBody> bodies = load_bodies(spec, silent);
    make_trees(spec, bodies);
    ShownRecording shown;
    shown.inputs = scene_inputs(spec);
    check_bodies(*recording, spec, bodies);
    spec = local_scene(std::move(spec), bodies, recording->origin());
    spec.resolve_start = false;
    ViewScene& scene = shown.scene;
    scene.title = recording->path().filename().string() + from_origin(recording->origin());
    scene.displacement_from = "the start";
    scene.up = up_of(spec);
    scene.recorded_frames = std::ranges::min(recording->trajectories(), {}, &TrajectoryInfo::frames).frames;
    shown.sources = sources_of_scene(spec, bodies, std::make_shared<const World>(build_world(spec, bodies)));
    for (std::size_t b = 0; b < bodies.size(); ++b) recording->read(b, 0, 1, shown.sources.bodies[b].start);
    scene.has_reactions = recording->has_reactions();
    show_frames(recording, 0, even_frames(scene.recorded_frames, argument.frames), shown);
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
    if (argument.margin) shown.margin = *argument.margin;
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
    ViewScene& scene = shown.scene;
    scene.title = fs::path(argument.source).filename().string() + from_origin(recording->origin());
    scene.displacement_from = "rest";
    scene.recorded_frames = info.frames;
    shown.sources.bodies.push_back(std::move(subject.source));
    try {
        shown.sources.obstacles = recipe_obstacles(info.recipe.str());
    } catch (const std::invalid_argument& error) {
        throw std::runtime_error(
            fmt::format("{}: trajectory {}: {}", frames.path, frames.trajectory, error.what()));
    }
    show_frames(recording, trajectory,
                frames.frame ? std::vector{*frames.frame} : even_frames(info.frames, argument.frames), shown);
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

void ShownRecording::read_nodes(int body, int frame, Vertices& x) const {
    recording->read(first + body, scene.numbers[frame], 1, x);
}

ShownRecording open_recording(const SourceArgument& argument, const Output& out) {
    const auto [tree, pose] = parts_of(argument.source);
    if (const auto frames = recorded_frames(pose)) return open_frames(argument, tree, *frames);
    return open_scene(argument, out);
}

namespace {

/// What acts on the bodies in the last step of each frame that is shown, from the recording of a scene.
std::vector<std::vector<ViewReaction>> shown_reactions(const ShownRecording& shown) {
    const std::vector<RecordedReaction> rows = shown.recording->reactions();
    const std::vector<double> times = shown.recording->times(shown.first);
    std::vector<std::vector<ViewReaction>> frames;
    for (const int number : shown.scene.numbers) {
        std::vector<ViewReaction>& frame = frames.emplace_back();
        const auto begin = std::ranges::lower_bound(rows, number, {}, &RecordedReaction::frame),
                   end = std::ranges::upper_bound(rows, number, {}, &RecordedReaction::frame);
        for (const RecordedReaction& row : std::span(begin, end))
            if (row.time == times[number] && !row.is_of_cavity())
                frame.push_back(view_reaction(row.body - shown.first, row.force, row.torque, row.point,
                                              shown.recording->origin()));
    }
    return frames;
}

}  // namespace

ViewScene view_of_recording(ShownRecording shown) {
    ViewScene& scene = shown.scene;
    const int bodies = shown.sources.bodies.size(), frames = scene.frames();
    ShownFrame frame{std::vector<Vertices>(bodies), std::vector<Vertices>(bodies)};
    ViewMaker maker(shown.sources);
    maker.begin(scene);
    std::vector<std::vector<ViewReaction>> reactions;
    if (scene.has_reactions) reactions = shown_reactions(shown);
    for (int f = 0; f < frames; ++f) {
        for (int b = 0; b < bodies; ++b) {
            shown.read_nodes(b, f, frame.nodes[b]);
            if (shown.sources.bodies[b].has_forces)
                shown.recording->read_field(shown.first + b, FrameField::contact_forces, scene.numbers[f], 1,
                                            frame.contact_forces[b]);
        }
        if (scene.has_reactions) frame.reactions = std::move(reactions[f]);
        maker.add_frame(f, frame, scene);
        tell_progress("frames", f + 1, frames);
    }
    return std::move(scene);
}

ViewScene view_of_surface(const SourceArgument& argument) {
    const BoundKind bounds = argument.bounds.empty() ? BoundKind::boxes : bound_kind(argument.bounds);
    const std::string name = fs::path(argument.source).filename().string();
    std::optional<float> margin;
    if (argument.margin) margin = *argument.margin;
    const PoseArgument posed = read_pose(argument.source, bounds);
    check_model_of({&posed}, bounds, margin.has_value());
    const std::string title = name + from_origin(posed.origin);
    return view_of_surfaces({view_source(name, posed, bounds, margin)}, {posed.x}, title, 0);
}

}  // namespace nbd
