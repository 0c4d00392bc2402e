#include "training/files/frame_stream.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <set>

#include "tests/support/error_of.hpp"
#include "tests/support/file_damage.hpp"
#include "tests/training/bar.hpp"

namespace nbd {
namespace {

using test::Bar;
using test::error_of;
using FrameStream = test::FileTest;

TEST_F(FrameStream, VisitsEveryListedFrameOnceWithItsSurface) {
    const Bar bar(3, 2);
    bar.record(folder / "data.h5", 3, 300, 7);
    const RecordingReader data(folder / "data.h5");
    std::vector<FrameId> frames;  // dense frames, a gap wider than a window, and sparse frames
    for (int f = 0; f < 40; ++f) frames.push_back({0, f});
    for (int f = 250; f < 300; f += 7) frames.push_back({0, f});
    for (int f = 0; f < 300; f += 50) frames.push_back({2, f});

    std::vector<std::atomic<int>> visits(frames.size()), busy(frame_slots);
    std::set<const float*> buffers;
    std::mutex lock;
    for_each_frame(bar.body, data, frames, [&](int slot, int index, VerticesRef x) {
        EXPECT_EQ(busy[static_cast<std::size_t>(slot)]++, 0);
        const FrameId id = frames[static_cast<std::size_t>(index)];
        Vertices expected;
        apply_embedding(bar.body.W, bar.frame(7, id.trajectory, id.frame), expected);
        EXPECT_EQ(Vertices(x), expected) << "frame " << index;
        ++visits[static_cast<std::size_t>(index)];
        {
            const std::lock_guard guard(lock);
            buffers.insert(x.data());
        }
        --busy[static_cast<std::size_t>(slot)];
    });
    for (std::size_t i = 0; i < visits.size(); ++i) EXPECT_EQ(visits[i], 1) << "frame " << i;
    // However many frames there are, memory holds no more surfaces than slots.
    EXPECT_LE(buffers.size(), static_cast<std::size_t>(frame_slots));
}

TEST_F(FrameStream, RejectsARecordingOfAnotherBody) {
    Bar bar(1, 1);
    bar.record(folder / "data.h5", 2, 3, 7);
    const RecordingReader data(folder / "data.h5");
    EXPECT_NO_THROW(check_recording(bar.body, data));
    SurfaceBody other = bar.body;
    other.hash = std::string(64, 'c');
    EXPECT_NE(error_of([&] {
                  check_recording(other, data);
              }).find("trajectory 0 is of body bbbbbbbbbbbb, but this body is cccccccccccc"),
              std::string::npos);
    other = bar.body;
    other.W.conservativeResize(other.W.rows(), 50);
    EXPECT_NE(error_of([&] { check_recording(other, data); }).find("has 36 nodes, but the body has 50"),
              std::string::npos);
}

}  // namespace
}  // namespace nbd
