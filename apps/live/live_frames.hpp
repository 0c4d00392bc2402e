#pragma once

#include <atomic>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "apps/view/make_view.hpp"
#include "apps/view/page.hpp"

namespace nbd {

/// A frame of a run as a page needs it.
struct LiveFrame {
    int number = 0;
    double time = 0;  // seconds
    ShownFrame shown{};
};

/// How a run has ended, if it has.
enum class RunState { running, done, stopped, failed };

/// The frames of a run that goes on, and the page that shows them. One thread adds frames, others ask for
/// texts; adding waits for nobody who makes a text. A text is made when it is asked for first, and its frame
/// is dropped then.
class LiveFrames {
 public:
    /// sources: what they refer to must not change. scene: what the page says of the run, without frames.
    LiveFrames(ViewSources sources, ViewScene scene, LivePage page);

    void add(LiveFrame frame);
    /// message: why the run failed.
    void end(RunState state, std::string message);

    /// The page, with the first frame, which must have been added. It and answer() throw where a frame cannot
    /// be shown, such as one with numbers that are not finite.
    const std::string& page();

    /// What a page of the run is told that has the first `from` frames, as JSON: the state of the run and
    /// some of the next frames. A page has all frames of a run that has ended when it is told none. Empty if
    /// the page is of another run.
    std::string answer(const std::string& run, std::size_t from);

    /// Whether as many pages as were made were told that the run has ended, and have all frames; one at
    /// least.
    bool told_end() const noexcept { return ends_told_ > 0 && ends_told_ >= pages_; }

 private:
    struct Entry {
        std::optional<LiveFrame> frame;  // until its text is made
        std::string text;
    };

    std::optional<LiveFrame> take_frame(std::size_t i);
    void begin_page();
    template <class Use>
    bool with_scene(std::size_t i, const Use& use);
    void make_text(std::size_t i);

    const LivePage facts_;
    std::mutex making_;  // held while texts are made, by one thread at a time
    ViewMaker maker_;
    ViewScene scene_;  // of one frame
    std::string page_;

    std::mutex guard_;  // of what follows, held for moments
    std::deque<Entry> entries_;
    RunState state_ = RunState::running;
    std::string message_;
    std::atomic<int> pages_ = 0, ends_told_ = 0;  // answers: of the page, and that the run has ended
};

}  // namespace nbd
