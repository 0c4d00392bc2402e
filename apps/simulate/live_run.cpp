#include "apps/simulate/live_run.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <thread>
#include <utility>

#include "apps/cli/interrupt.hpp"
#include "apps/view/scene_view.hpp"

namespace nbd {
namespace {

void wait(int milliseconds) { std::this_thread::sleep_for(std::chrono::milliseconds(milliseconds)); }

/// A name that no other run of this machine has.
std::string run_name() {
    return fmt::format("{:x}-{:x}", getpid(), std::chrono::system_clock::now().time_since_epoch().count());
}

}  // namespace

void LiveRun::begin(const SceneSpec& spec, std::span<const LoadedBody> bodies,
                    const std::shared_ptr<const World>& world, std::string title) {
    ViewSources sources = sources_of_scene(spec, bodies, world);
    std::size_t bytes = 0;  // of a frame
    for (int b = 0; b < world->body_count(); ++b) {
        ViewSource& source = sources.bodies[b];
        source.start = world->state(b).x.cast<float>();
        source.has_forces = true;
        bytes += 6 * sizeof(float) * static_cast<std::size_t>(source.start.rows());
    }
    const int fit = static_cast<int>(std::clamp<std::size_t>(most_bytes / bytes, 2, most_frames));
    shown_ = even_frames(spec.time.frames + 1, fit);
    ViewScene scene;
    scene.title = title + from_origin(world->origin());
    scene.displacement_from = "the start";
    scene.up = up_of(spec);
    scene.recorded_frames = spec.time.frames + 1;
    const double seconds = spec.time.dt * spec.time.frames * spec.time.steps_per_frame;
    frames_.emplace(std::move(sources), std::move(scene),
                    LivePage{run_name(), static_cast<int>(shown_.size()), seconds});
}

void LiveRun::add(const SimulationFrame& frame) {
    if (!std::ranges::binary_search(shown_, frame.number)) return;
    LiveFrame shown{.number = frame.number, .time = frame.world.time};
    for (const BodyState& state : frame.world.bodies) shown.nodes.push_back(state.x.cast<float>());
    for (const Nodes& forces : frame.contact_forces) shown.contact_forces.push_back(forces.cast<float>());
    frames_->add(std::move(shown));
    if (!std::exchange(serves_, true)) server_.serve(*frames_);
}

void LiveRun::end(RunState state, const std::string& message) {
    frames_->end(state, message);
    // An open page asks again within five seconds, and has to draw in between.
    const bool was_interrupted = interrupted();
    for (int i = 0; i < 600 && interrupted() == was_interrupted; ++i, wait(50))
        if (server_.idle_seconds() > (frames_->told_end() ? 1.2 : 10)) return;
}

void LiveRun::keep_serving() const {
    while (!interrupted()) wait(50);
}

}  // namespace nbd
