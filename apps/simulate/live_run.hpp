#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "apps/live/live_frames.hpp"
#include "apps/live/live_server.hpp"
#include "apps/simulate/simulation_frame.hpp"
#include "sim/scene/scene.hpp"

namespace nbd {

/// Shows a run in browsers of this machine while it goes on, as `view` shows its recording. It reads what the
/// run makes and changes nothing of it.
class LiveRun {
 public:
    /// Most frames of a run that a page shows, evenly spread, and most bytes that they take before a page has
    /// asked for them. There are at least two.
    static constexpr int most_frames = 300;
    static constexpr std::size_t most_bytes = 256 << 20;

    /// Takes the port; 0: any that is free. Throws std::runtime_error if it cannot be had.
    explicit LiveRun(int port) : server_(port) {}

    /// Prepares the page. title: of it. world: of the scene, at its start.
    void begin(const SceneSpec& spec, std::span<const LoadedBody> bodies,
               const std::shared_ptr<const World>& world, std::string title);

    std::string url() const { return server_.url(); }

    /// Call it for each frame, in order; the page shows some of them. With the first one the server begins to
    /// answer.
    void add(const SimulationFrame& frame);

    /// Says how the run has ended, and waits until pages that are open have got the rest, for thirty seconds
    /// at most. message: why it failed.
    void end(RunState state, const std::string& message);

    /// Serves until Ctrl-C.
    void keep_serving() const;

 private:
    std::vector<int> shown_;  // numbers of frames, ascending
    std::optional<LiveFrames> frames_;
    bool serves_ = false;
    LiveServer server_;
};

}  // namespace nbd
