#include "apps/view/scene_view.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>
#include <utility>

namespace nbd {
namespace {

[[noreturn]] void refuse(const RecordingReader& recording, const std::string& what) {
    throw std::runtime_error(fmt::format("{}: {}", recording.path().string(), what));
}

void check_bodies(const RecordingReader& recording, const SceneSpec& spec,
                  std::span<const LoadedBody> bodies) {
    const auto& trajectories = recording.trajectories();
    if (trajectories.size() != bodies.size())
        refuse(recording, fmt::format("has {} trajectories, but its scene has {} bodies", trajectories.size(),
                                      bodies.size()));
    for (std::size_t b = 0; b < bodies.size(); ++b)
        if (trajectories[b].body_hash != body_hash(*bodies[b].body))
            refuse(recording, fmt::format("body {} '{}' was recorded from another body than {}", b,
                                          spec.bodies[b].name, spec.bodies[b].file.string()));
}

/// How many frames all bodies have, and that is at least one.
int common_frames(const RecordingReader& recording) {
    const auto& trajectories = recording.trajectories();
    const int frames = std::ranges::min(trajectories, {}, &TrajectoryInfo::frames).frames;
    if (frames == 0) refuse(recording, "has no frames");
    return frames;
}

}  // namespace

std::string from_origin(const Eigen::Vector3d& origin) {
    if (origin.isZero(0)) return {};
    return fmt::format(", from ({}, {}, {}) m", origin.x(), origin.y(), origin.z());
}

Eigen::Vector3d up_of(const SceneSpec& spec) {
    if (spec.gravity.norm() > 0) return -spec.gravity.normalized();
    return Eigen::Vector3d::UnitZ();
}

ViewSources sources_of_scene(const SceneSpec& spec, std::span<const LoadedBody> bodies,
                             std::shared_ptr<const World> world) {
    ViewSources sources;
    for (std::size_t b = 0; b < bodies.size(); ++b) {
        const int body = b;
        const SceneBody& of_scene = spec.bodies[b];
        ViewSource& source = sources.bodies.emplace_back();
        source.name = of_scene.name;
        source.tree = {
            .tree = bodies[b].tree,
            .W = bodies[b].body->float_weights(),
            .bounds = of_scene.bounds,
            .margin = of_scene.margin ? std::optional(static_cast<float>(*of_scene.margin)) : std::nullopt};
        source.rest = embedded(source.tree.W, world->elastic(body).rest().X.cast<float>());
        source.elastic = std::shared_ptr<const ElasticBody>(world, &world->elastic(body));
    }
    sources.obstacles.assign(world->obstacles().begin(), world->obstacles().end());
    sources.contact_distance = world->thickness();
    sources.self_contact = spec.contact.self_contact || spec.contact.intersection_free;
    return sources;
}

ShownRecording shown_scene(std::shared_ptr<const RecordingReader> recording, SceneSpec spec,
                           std::span<const LoadedBody> bodies, int frames) {
    check_bodies(*recording, spec, bodies);
    spec = local_scene(std::move(spec), bodies, recording->origin());
    spec.resolve_start = false;
    ShownRecording shown;
    shown.origin = recording->origin();
    ViewScene& scene = shown.scene;
    scene.title = recording->path().filename().string() + from_origin(recording->origin());
    scene.displacement_from = "the start";
    scene.up = up_of(spec);
    scene.recorded_frames = common_frames(*recording);
    scene.numbers = even_frames(scene.recorded_frames, frames);
    const std::vector<double> times = recording->times(0);
    for (const int number : scene.numbers) scene.times.push_back(times[number]);

    ViewSources& sources = shown.sources;
    sources = sources_of_scene(spec, bodies, std::make_shared<const World>(build_world(spec, bodies)));
    for (std::size_t b = 0; b < bodies.size(); ++b) {
        recording->read(b, 0, 1, sources.bodies[b].start);
        sources.bodies[b].has_forces = recording->has(b, FrameField::contact_forces);
    }
    sources.read_nodes = [recording](int body, int frame, Vertices& x) {
        recording->read(body, frame, 1, x);
    };
    sources.read_forces = [recording](int body, int frame, Vertices& x) {
        recording->read_field(body, FrameField::contact_forces, frame, 1, x);
    };
    return shown;
}

}  // namespace nbd
