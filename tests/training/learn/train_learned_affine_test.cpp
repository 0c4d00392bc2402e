#include "training/learn/train_learned_affine.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/support/error_of.hpp"
#include "tests/support/file_damage.hpp"
#include "tests/support/on_threads.hpp"
#include "tests/training/bar.hpp"
#include "training/calibrate/calibrate.hpp"
#include "training/evaluate/coverage.hpp"
#include "training/files/split.hpp"
#include "training/learn/train_tree.hpp"

namespace nbd {
namespace {

using test::Bar;

/// A bar with learned affine bounds trained on 30 trajectories of 12 frames and calibrated on 15 others.
class TrainLearnedAffine : public test::FileTest {
 protected:
    void SetUp() override {
        test::FileTest::SetUp();
        bar.record(folder / "data.h5", 60, 12, 2);
    }
    TreeFile train() const {
        return train_tree(bar.body, RecordingReader(folder / "data.h5"),
                          {.bounds = {BoundKind::learned_affine},
                           .tree = {.depth = 4},
                           .held_out_share = 0.25,
                           .calibration_share = 1.0 / 3,
                           .random_frame_share = 0});
    }

    Bar bar{0, 12};
};

TEST_F(TrainLearnedAffine, KeepsTheStatedMissRateOnUnseenTrajectories) {
    const RecordingReader data(folder / "data.h5");
    TreeFile file = train();
    calibrate(file, data, {.miss_rate = 0.02});
    const Calibration& calibration = file.tree.calibrations.at(BoundKind::learned_affine);
    EXPECT_EQ(calibration.trajectories, 15);
    EXPECT_EQ(calibration.margins.size(), bound_count(file.tree, BoundKind::learned_affine));
    EXPECT_GT(std::ranges::max(calibration.margins), 0);

    const auto held_out = frames_of(data, file.facts.split, FrameSet::held_out);
    const auto rows =
        measure_coverage(bar.body, refer_to(file.tree), BoundKind::learned_affine, data, held_out);
    ASSERT_EQ(rows.size(), 3u);
    for (const CoverageRow& row : rows) {
        EXPECT_GE(row.keeping, row.trajectories * 8 / 10) << row.depth;
        EXPECT_LT(row.inflation, 0.6) << row.depth;
        EXPECT_GT(row.inflation, 0) << row.depth;
        EXPECT_LT(row.out_of_range, 0.2) << row.depth;
    }

    // Without margins some nodes miss, so the margins matter.
    TreeFile bare = file;
    Calibration& none = bare.tree.calibrations.at(BoundKind::learned_affine);
    std::ranges::fill(none.margins, 0.f);
    double missing = 0;
    int fewest = rows.front().trajectories;
    for (const CoverageRow& row :
         measure_coverage(bar.body, refer_to(bare.tree), BoundKind::learned_affine, data, held_out)) {
        missing += row.nodes_missing;
        fewest = std::min(fewest, row.keeping);
    }
    EXPECT_GT(missing, 0);
    EXPECT_LT(fewest, rows.front().trajectories * 8 / 10) << "or the rate is kept without any calibration";
}

TEST_F(TrainLearnedAffine, GivesTheSameOnAnyNumberOfThreads) {
    const auto fit = [&] { return train().tree.learned_affine->fit(); };
    const LearnedAffineFit one = test::on_threads(1, fit), three = test::on_threads(3, fit);
    EXPECT_EQ(one.samples, three.samples);
    EXPECT_EQ(one.growth, three.growth);
    EXPECT_EQ(one.residual, three.residual);
    EXPECT_GT(std::ranges::max(one.growth), 0);
}

TEST_F(TrainLearnedAffine, RefusesAnEmptyTraining) {
    const RecordingReader data(folder / "data.h5");
    FrameSource source(bar.body.W, data);
    const CollisionTree tree = make_exact_tree(bar.body.X, bar.body.F);
    EXPECT_EQ(test::error_of([&] { train_learned_affine(bar.body, tree.boxes->tree(), source, {}, {}); }),
              "no pose to fit learned affine bounds to");
}

}  // namespace
}  // namespace nbd
