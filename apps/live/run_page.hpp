#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "apps/live/live_frames.hpp"
#include "sim/scene/scene.hpp"

namespace nbd {

/// Shows a run in browsers of this machine while it goes on, as `view` shows its recording. It reads what the
/// run makes and changes nothing of it. Its server listens on 127.0.0.1 alone, answers GET and HEAD, and
/// refuses questions that were sent to another name.
class RunPage {
 public:
    /// Most frames of a run that a page shows, evenly spread, and most bytes that they take before a page has
    /// asked for them. There are at least two.
    static constexpr int most_frames = 300;
    static constexpr std::size_t most_bytes = 256 << 20;

    /// Takes the port; 0: any that is free. Throws std::runtime_error, one line, if it cannot be had.
    explicit RunPage(int port);
    ~RunPage();
    RunPage(const RunPage&) = delete;
    RunPage& operator=(const RunPage&) = delete;

    /// Prepares the page. title: of it. world: of the scene, at its start.
    void begin(const SceneSpec& spec, std::span<const LoadedBody> bodies,
               const std::shared_ptr<const World>& world, std::string title);

    std::string url() const;  // "http://127.0.0.1:8000/"

    /// Call it for each frame, in order; the page shows some of them. With the first one the server begins to
    /// answer, from threads of its own. contact_forces: [bodies] at the nodes, N. reactions: of the frame's
    /// last step.
    void add(int number, const WorldSnapshot& frame, const std::vector<Nodes>& contact_forces,
             std::span<const Reaction> reactions);

    /// Says how the run has ended, and waits until pages that are open have got the rest, for thirty seconds
    /// at most. message: why it failed.
    void end(RunState state, const std::string& message);

    /// Serves until Ctrl-C.
    void keep_serving() const;

 private:
    struct Server;
    std::unique_ptr<Server> server_;
    std::vector<int> shown_;                            // numbers of frames, ascending
    Eigen::Vector3d origin_ = Eigen::Vector3d::Zero();  // of the world
};

}  // namespace nbd
