#include "apps/live/live_frames.hpp"

#include <fmt/format.h>

#include <array>
#include <nlohmann/json.hpp>
#include <sstream>

namespace nbd {
namespace {

/// Frames and bytes of an answer, at most, but for its last frame.
constexpr std::size_t most_frames = 32, most_bytes = 4 << 20;

constexpr std::array state_names{"running", "done", "stopped", "failed"};  // of RunState

/// Drops the frames of a scene, and keeps its bodies and obstacles.
void clear_frames(ViewScene& scene) {
    scene.pairs.clear();
    scene.reactions.clear();
    for (ViewBody& body : scene.bodies) {
        for (NodeScalar& scalar : body.scalars) scalar.values.clear();
        body.bounds->values.clear();
        body.near = body.intersecting = body.missed = {};
    }
    for (ViewObstacle& obstacle : scene.obstacles) obstacle.places.clear();
}

}  // namespace

LiveFrames::LiveFrames(ViewSources sources, ViewScene scene, LivePage page)
    : facts_(std::move(page)), maker_(std::move(sources)), scene_(std::move(scene)) {
    maker_.begin(scene_);
}

void LiveFrames::add(LiveFrame frame) {
    const std::lock_guard lock(guard_);
    entries_.push_back({std::move(frame), {}});
}

void LiveFrames::end(RunState state, std::string message) {
    const std::lock_guard lock(guard_);
    state_ = state;
    message_ = std::move(message);
}

std::optional<LiveFrame> LiveFrames::take_frame(std::size_t i) {
    const std::lock_guard lock(guard_);
    if (i >= entries_.size()) return std::nullopt;
    return std::exchange(entries_[i].frame, std::nullopt);
}

/// Makes the page if there is a first frame. Call it with making_ held.
void LiveFrames::begin_page() {
    if (!page_.empty()) return;
    std::ostringstream out;
    if (!with_scene(0, [&] { write_page(out, scene_, facts_); })) return;
    page_ = std::move(out).str();
}

/// Makes the scene of frame i and calls use(), unless the frame is not there or was used. If either throws,
/// the frame is there again. Call it with making_ held.
template <class Use>
bool LiveFrames::with_scene(std::size_t i, const Use& use) {
    std::optional<LiveFrame> frame = take_frame(i);
    if (!frame) return false;
    try {
        clear_frames(scene_);
        scene_.times = {frame->time};
        scene_.numbers = {frame->number};
        maker_.add_frame(0, frame->shown, scene_);
        use();
    } catch (...) {
        const std::lock_guard lock(guard_);
        entries_[i].frame = std::move(frame);
        throw;
    }
    return true;
}

/// Makes the text of a frame that does not have one. Call it with making_ held.
void LiveFrames::make_text(std::size_t i) {
    std::string text;
    if (!with_scene(i, [&] { text = frames_text(scene_); })) return;
    const std::lock_guard lock(guard_);
    entries_[i].text = std::move(text);
}

const std::string& LiveFrames::page() {
    const std::lock_guard lock(making_);
    begin_page();
    ++pages_;
    return page_;
}

std::string LiveFrames::answer(const std::string& run, std::size_t from) {
    if (run != facts_.run) return {};
    const std::lock_guard making(making_);
    begin_page();
    std::size_t count = 0;
    RunState state = RunState::running;
    std::string message;
    {
        const std::lock_guard lock(guard_);
        count = entries_.size();
        state = state_;
        message = message_;
    }
    std::string frames;
    std::size_t next = std::max<std::size_t>(from, 1);
    for (; next < count && next < from + most_frames && frames.size() < most_bytes; ++next) {
        make_text(next);
        const std::lock_guard lock(guard_);
        frames += (frames.empty() ? "" : ",") + entries_[next].text;
    }
    if (state != RunState::running && from >= count) ++ends_told_;
    const nlohmann::json told = message;
    return fmt::format(R"({{"state":"{}","message":{},"frames":[{}]}})",
                       state_names[static_cast<std::size_t>(state)],
                       told.dump(-1, ' ', true, nlohmann::json::error_handler_t::replace), frames);
}

}  // namespace nbd
