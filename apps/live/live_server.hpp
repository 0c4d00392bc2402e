#pragma once

#include <memory>
#include <string>

namespace nbd {

class LiveFrames;

/// Serves the page of a run to this machine's own browsers: it listens on 127.0.0.1 alone, answers GET and
/// HEAD, and refuses questions that were sent to another name.
class LiveServer {
 public:
    /// Takes the port; 0: any that is free. Throws std::runtime_error, one line, if it cannot be had.
    explicit LiveServer(int port);
    ~LiveServer();
    LiveServer(const LiveServer&) = delete;
    LiveServer& operator=(const LiveServer&) = delete;

    /// Serves these frames from threads of its own. Call once. frames: must outlive this object.
    void serve(LiveFrames& frames);

    std::string url() const;  // "http://127.0.0.1:8000/"

    /// Seconds since the last question, or its answer; infinite before the first.
    double idle_seconds() const;

 private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace nbd
