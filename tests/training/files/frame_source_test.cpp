#include "training/files/frame_source.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <mutex>
#include <set>

#include "tests/support/error_of.hpp"
#include "tests/support/file_damage.hpp"
#include "tests/training/bar.hpp"
#include "training/files/recording_hash.hpp"

namespace nbd {
namespace {

using test::Bar;
using test::error_of;
using FrameSourceFile = test::FileTest;

TEST_F(FrameSourceFile, VisitsEveryListedFrameOnceWithItsSurface) {
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
    FrameSource(bar.body.W, data, 0).for_each_frame(frames, [&](int slot, int index, VerticesRef x) {
        EXPECT_EQ(busy[slot]++, 0);
        const FrameId id = frames[index];
        Vertices expected;
        apply_embedding(bar.body.W, bar.frame(7, id.trajectory, id.frame), expected);
        EXPECT_EQ(Vertices(x), expected) << "frame " << index;
        ++visits[index];
        {
            const std::lock_guard guard(lock);
            buffers.insert(x.data());
        }
        --busy[slot];
    });
    for (std::size_t i = 0; i < visits.size(); ++i) EXPECT_EQ(visits[i], 1) << "frame " << i;
    // However many frames there are, memory holds no more surfaces than slots.
    EXPECT_LE(buffers.size(), static_cast<std::size_t>(frame_slots));
}

TEST_F(FrameSourceFile, RejectsARecordingOfAnotherBody) {
    Bar bar(1, 1);
    bar.record(folder / "data.h5", 2, 3, 7);
    const RecordingReader data(folder / "data.h5");
    EXPECT_NO_THROW(check_recording(bar.body.hash, bar.body.W.cols(), data));
    SurfaceBody other = bar.body;
    other.hash = std::string(64, 'c');
    EXPECT_NE(error_of([&] {
                  check_recording(other.hash, other.W.cols(), data);
              }).find("trajectory 0 is of body bbbbbbbbbbbb, but this body is cccccccccccc"),
              std::string::npos);
    other = bar.body;
    other.W.conservativeResize(other.W.rows(), 50);
    EXPECT_NE(error_of([&] {
                  check_recording(other.hash, other.W.cols(), data);
              }).find("has 36 nodes, but the body has 50"),
              std::string::npos);
}

using FrameSourceTest = test::FileTest;

/// Surface positions of all frames in their order, and slots by frame.
struct Pass {
    std::vector<Vertices> x;
    std::vector<int> slots;
    bool operator==(const Pass&) const = default;
};

Pass pass(FrameSource& source, std::span<const FrameId> frames) {
    Pass seen{std::vector<Vertices>(frames.size()), std::vector<int>(frames.size())};
    source.for_each_frame(frames, [&](int slot, int index, VerticesRef x) {
        seen.x[index] = x;
        seen.slots[index] = slot;
    });
    return seen;
}

TEST_F(FrameSourceTest, GivesTheSamePassesWhateverItHasRoomFor) {
    const Bar fine(3, 4), coarse(3, 1);  // more vertices than nodes, and fewer
    ASSERT_GT(fine.body.X.rows(), Bar::nodes);
    ASSERT_LT(coarse.body.X.rows(), Bar::nodes);
    fine.record(folder / "data.h5", 3, 150, 7, {1});
    for (const Bar* bar : {&fine, &coarse}) {
        const auto bytes = [](Eigen::Index rows) { return static_cast<std::size_t>(rows) * 12; };
        const std::size_t surface = bytes(bar->body.X.rows()), nodes = bytes(Bar::nodes);
        const RecordingReader streamed(folder / "data.h5");
        FrameSource none(bar->body.W, streamed, 0);
        const auto all = complete_frames(streamed);  // 300, of two trajectories
        ASSERT_EQ(all.size(), 300u);
        const auto some = spread(all, 70);
        const Pass every = pass(none, all), few = pass(none, some);
        EXPECT_EQ(none.kept_bytes(), 0u);
        EXPECT_GE(streamed.frames_read(), 500);
        for (const std::size_t room : {nodes, 100 * nodes, 300 * nodes, 450 * surface})
            for (const bool hashed : {false, true}) {
                const RecordingReader data(folder / "data.h5");
                FrameSource source(bar->body.W, data, room);
                if (hashed) {
                    EXPECT_EQ(source.hashes(some).hex, hash_recording(streamed).hex);
                }
                EXPECT_EQ(pass(source, some), few) << room;
                EXPECT_EQ(pass(source, all), every) << room;
                EXPECT_EQ(pass(source, some), few) << room;
                EXPECT_LE(source.kept_bytes(), room);
                const std::size_t of_frame = std::min(surface, room < 450 * surface ? nodes : surface);
                EXPECT_EQ(source.kept_bytes(), std::min(room / of_frame, all.size()) * of_frame) << room;
                const auto read = data.frames_read();
                source.for_each_pose(some, [&](int, int index, VerticesRef x, VerticesRef at) {
                    const FrameId id = some[index];
                    EXPECT_EQ(Vertices(x), few.x[index]);
                    EXPECT_EQ(Vertices(at), fine.frame(7, id.trajectory, id.frame));
                });
                if (room == 300 * nodes && bar == &fine) {
                    EXPECT_EQ(data.frames_read(), read);  // nodes are kept
                }
            }
    }
}

TEST_F(FrameSourceTest, ReadsEveryFrameOnceWhereThereIsRoom) {
    const Bar bar(3, 2);
    bar.record(folder / "data.h5", 4, 100, 7);
    const RecordingReader data(folder / "data.h5");
    FrameSource source(bar.body.W, data, 400 * static_cast<std::size_t>(bar.body.X.rows()) * 12);
    const auto frames = complete_frames(data);
    source.hashes(frames);
    for (int i = 0; i < 3; ++i) pass(source, frames);
    source.hashes();
    EXPECT_EQ(data.frames(), 400);
    EXPECT_EQ(data.frames_read(), 400);
}

TEST_F(FrameSourceTest, RefusesFramesOfAnotherBody) {
    const Bar bar(3, 2);
    bar.record(folder / "data.h5", 2, 5, 7);
    const RecordingReader data(folder / "data.h5");
    SurfaceEmbedding W = bar.body.W;
    W.conservativeResize(W.rows(), 50);
    FrameSource source(W, data);
    EXPECT_NE(error_of([&] {
                  source.hashes(complete_frames(data));
              }).find("trajectory 0 has 36 nodes, but the embedding has 50"),
              std::string::npos);
    EXPECT_NE(error_of([&] { pass(source, complete_frames(data)); }).find("but the embedding has 50"),
              std::string::npos);
}

TEST(FrameMemory, IsPartOfWhatTheMachineHas) {
    EXPECT_GT(default_frame_memory(), std::size_t{1} << 20);
    EXPECT_LT(default_frame_memory(), std::size_t{1} << 50);
}

}  // namespace
}  // namespace nbd
