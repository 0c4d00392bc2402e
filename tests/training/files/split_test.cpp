#include "training/files/split.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "tests/support/error_of.hpp"
#include "tests/support/file_damage.hpp"
#include "tests/training/bar.hpp"

namespace nbd {
namespace {

using test::Bar;
using test::error_of;

class Split : public test::FileTest {
 protected:
    RecordingReader recording(int trajectories, int frames, const std::vector<int>& failed = {}) {
        Bar(1, 1).record(folder / "data.h5", trajectories, frames, 1, failed);
        return RecordingReader(folder / "data.h5");
    }
};

TEST_F(Split, PartitionsTheFramesOfCompleteTrajectories) {
    const auto data = recording(20, 30, {3, 11});
    const TrainingSplit split = make_split(data, 0.25, 0.2, 5);
    EXPECT_EQ(split.held_out_trajectories.size(), 5u);  // a quarter of 18, rounded
    EXPECT_EQ(split.train_trajectories.size(), 13u);
    std::set<FrameId> all;
    std::size_t sum = 0;
    for (const FrameSet set : {FrameSet::train, FrameSet::random_test, FrameSet::held_out}) {
        const auto frames = frames_of(data, split, set);
        EXPECT_TRUE(std::ranges::is_sorted(frames));
        EXPECT_FALSE(frames.empty());
        sum += frames.size();
        all.insert(frames.begin(), frames.end());
    }
    EXPECT_EQ(sum, all.size());
    const auto complete = complete_frames(data);
    EXPECT_EQ(complete.size(), 18u * 30u);
    EXPECT_TRUE(std::ranges::equal(all, complete));
    EXPECT_NEAR(static_cast<double>(frames_of(data, split, FrameSet::random_test).size()) / (13 * 30), 0.2,
                0.06);
}

TEST_F(Split, DependsOnlyOnTheSeed) {
    const auto data = recording(20, 4);
    const auto held_out = [&](std::uint64_t seed) {
        return make_split(data, 0.3, 0.1, seed).held_out_trajectories;
    };
    EXPECT_EQ(held_out(1), held_out(1));
    EXPECT_NE(held_out(1), held_out(2));
}

TEST_F(Split, TakesCalibrationTrajectoriesFromTheRest) {
    const auto data = recording(20, 6, {3, 11});
    const TrainingSplit without = make_split(data, 0.25, 0.2, 5),
                        split = make_split(data, 0.25, 0.2, 5, 0.25);
    EXPECT_EQ(split.held_out_trajectories, without.held_out_trajectories);
    EXPECT_TRUE(without.calibration_trajectories.empty());
    EXPECT_EQ(split.calibration_trajectories.size(), 3u);  // a quarter of 13, rounded
    std::vector<int> together = split.train_trajectories;
    together.insert(together.end(), split.calibration_trajectories.begin(),
                    split.calibration_trajectories.end());
    std::ranges::sort(together);
    EXPECT_EQ(together, without.train_trajectories);

    std::set<FrameId> seen;
    for (const FrameSet set :
         {FrameSet::train, FrameSet::random_test, FrameSet::calibration, FrameSet::held_out})
        for (const FrameId& frame : frames_of(data, split, set)) EXPECT_TRUE(seen.insert(frame).second);
    EXPECT_EQ(seen.size(), complete_frames(data).size());
    EXPECT_EQ(frames_of(data, split, FrameSet::calibration).size(), 3u * 6);

    EXPECT_TRUE(make_split(recording(1, 4), 0, 0, 1, 0.5).calibration_trajectories.empty());
    EXPECT_EQ(make_split(recording(2, 4), 0, 0, 1, 0.1).calibration_trajectories.size(), 1u);
    EXPECT_EQ(error_of([&] { make_split(data, 0, 0, 1, 1); }),
              "share of calibration trajectories 1; allowed: [0, 1)");
}

TEST_F(Split, HoldsOutAndKeepsAtLeastOneTrajectory) {
    const auto data = recording(3, 4);
    EXPECT_EQ(make_split(data, 0.01, 0, 1).held_out_trajectories.size(), 1u);
    EXPECT_TRUE(make_split(data, 0, 0, 1).held_out_trajectories.empty());
    EXPECT_NE(error_of([&] {
                  make_split(data, 0.99, 0, 1);
              }).find("has 3 complete trajectories, and holding out 3 of them leaves none to train on"),
              std::string::npos);
}

TEST_F(Split, RejectsARecordingWithoutCompleteTrajectories) {
    const auto data = recording(2, 4, {0, 1});
    EXPECT_NE(error_of([&] {
                  make_split(data, 0.5, 0, 1);
              }).find("has 0 complete trajectories, and holding out 1 of them leaves none to train on"),
              std::string::npos);
    EXPECT_TRUE(complete_frames(data).empty());
}

TEST_F(Split, RejectsSharesOutOfRange) {
    const auto data = recording(2, 4);
    EXPECT_EQ(error_of([&] { make_split(data, 1, 0, 1); }),
              "share of held-out trajectories 1; allowed: [0, 1)");
    EXPECT_EQ(error_of([&] { make_split(data, 0, -0.5, 1); }),
              "share of random test frames -0.5; allowed: [0, 1)");
}

TEST(Spread, SpacesFramesEvenlyWithoutRepeats) {
    std::vector<FrameId> frames;
    for (int i = 0; i < 100; ++i) frames.push_back({0, i});
    const auto ten = spread(frames, 10);
    ASSERT_EQ(ten.size(), 10u);
    for (int i = 0; i < 10; ++i) EXPECT_EQ(ten[i].frame, 10 * i);
    EXPECT_EQ(spread(frames, 1000), frames);
}

}  // namespace
}  // namespace nbd
