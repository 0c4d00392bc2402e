#include "training/learn/train_learned_affine.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "collision/tree/posed_tree.hpp"
#include "tests/support/error_of.hpp"
#include "tests/support/file_damage.hpp"
#include "tests/support/on_threads.hpp"
#include "tests/training/bar.hpp"
#include "training/calibrate/calibrate.hpp"
#include "training/evaluate/coverage.hpp"
#include "training/files/split.hpp"
#include "training/learn/train_tree.hpp"
#include "training/learn/transfer_tree.hpp"

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

class TransferTree : public test::FileTest {
 protected:
    TreeFile trained() const {
        coarse.record(folder / "data.h5", 12, 25, 2);
        TrainConfig config;
        config.bounds = {BoundKind::nbd};
        config.tree.depth = 4;
        config.mlp.max_epochs = 10;
        TreeFile file = train_tree(coarse.body, RecordingReader(folder / "data.h5"), config);
        const std::size_t nodes = file.tree.spheres.nodes.size();
        file.tree.calibrations[BoundKind::nbd] = {.miss_rate = 0.01,
                                                  .confidence = 0.9,
                                                  .trajectories = 2,
                                                  .poses = 50,
                                                  .margins = std::vector<float>(nodes, 0.01f)};
        return file;
    }
    Bar coarse{12, 4}, fine{12, 8};
};

TEST_F(TransferTree, BoundsTheSameNodesOfAFinerSurface) {
    const TreeFile before = trained();
    const TreeFile after = transfer_tree(before, fine.body);
    EXPECT_NO_THROW(check_collision_tree(after.tree));
    EXPECT_EQ(after.tree.spheres.nodes.size(), before.tree.spheres.nodes.size());
    EXPECT_EQ(after.tree.faces, fine.body.F);
    EXPECT_EQ(after.facts.body_hash, fine.body.hash);
    EXPECT_EQ(after.tree.calibrations.at(BoundKind::nbd).margins[3], 0.01f);
    for (std::size_t i = 0; i < after.tree.spheres.nodes.size(); ++i) {
        const SphereTree::Node &a = before.tree.spheres.nodes[i], &b = after.tree.spheres.nodes[i];
        EXPECT_EQ(b.first_child, a.first_child);
        EXPECT_EQ(b.face_end - b.face_begin, 4 * (a.face_end - a.face_begin));
        const Sphere &s = before.tree.spheres.rest[i], &t = after.tree.spheres.rest[i];
        EXPECT_LT((s.c - t.c).norm(), 0.15f * s.r) << i;
    }
}

TEST_F(TransferTree, KeepsNbdSpheres) {
    const TreeFile before = trained();
    const TreeFile after = transfer_tree(before, fine.body);
    EXPECT_NO_THROW(check_collision_tree(after.tree));
    PosedTree a(std::make_shared<const CollisionTree>(before.tree), BoundKind::nbd, 0.f),
        b(std::make_shared<const CollisionTree>(after.tree), BoundKind::nbd, 0.f);
    float moved = 0;
    for (int frame = 0; frame < 5; ++frame) {
        Vertices x, y;
        apply_embedding(coarse.body.W, coarse.frame(99, frame, frame), x);
        apply_embedding(fine.body.W, fine.frame(99, frame, frame), y);
        a.begin_pose(x);
        b.begin_pose(y);
        for (int i = 0; i < std::ssize(before.tree.spheres.nodes); ++i) {
            const Sphere &s = a.sphere(i), &t = b.sphere(i), &rest = before.tree.spheres.rest[i];
            EXPECT_LT((s.c - t.c).norm(), 1e-4f * rest.r) << i;
            EXPECT_NEAR(s.r, t.r, 1e-4f * rest.r) << i;
            moved = std::max(moved, (s.c - rest.c).norm() / rest.r);
        }
    }
    EXPECT_GT(moved, 0.1f);
}

TEST_F(TransferTree, RejectsOtherSurfacesAndTreesWithoutTransferableBounds) {
    TreeFile before = trained();
    SurfaceBody other = fine.body;
    other.X *= 1.5f;
    EXPECT_NE(test::refusal([&] { transfer_tree(before, other); }), "");
    const SurfaceBody coarser = Bar(12, 1).body;
    EXPECT_NE(
        test::refusal([&] { transfer_tree(before, coarser); }).find("from the surface's nearest vertex"),
        std::string::npos);
    SurfaceBody part = fine.body;
    part.F = fine.body.F.topRows(40).eval();
    EXPECT_NE(
        test::refusal([&] { transfer_tree(before, part); }).find("gets no face: the surface is too coarse"),
        std::string::npos);
    before.tree.nbd.reset();
    before.tree.calibrations.clear();
    EXPECT_EQ(test::refusal([&] { transfer_tree(before, fine.body); }),
              "the tree has no nbd bounds to transfer");
}

}  // namespace
}  // namespace nbd
