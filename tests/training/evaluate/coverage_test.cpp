#include "training/evaluate/coverage.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <span>
#include <utility>

#include "collision/tree/posed_tree.hpp"
#include "tests/support/error_of.hpp"
#include "tests/support/file_damage.hpp"
#include "tests/support/on_threads.hpp"
#include "tests/training/bar.hpp"
#include "training/calibrate/calibrate.hpp"
#include "training/evaluate/contact_scenes.hpp"
#include "training/files/split.hpp"
#include "training/learn/train_tree.hpp"

namespace nbd {
namespace {

using test::Bar;
using test::error_of;

/// A bar with nbd and learned affine bounds trained on 30 trajectories of 12 frames and calibrated on 15
/// others.
class Coverage : public test::FileTest {
 protected:
    void SetUp() override {
        test::FileTest::SetUp();
        bar.record(folder / "data.h5", 60, 12, 2);
        const RecordingReader data(folder / "data.h5");
        const TrainConfig config{.bounds = {BoundKind::nbd, BoundKind::learned_affine},
                                 .tree = {.depth = 3},
                                 .clusters = {.k_means = {.clusters = 40}, .initialisations = 1},
                                 .held_out_share = 0.25,
                                 .calibration_share = 1.0 / 3,
                                 .random_frame_share = 0,
                                 .mlp = {.max_epochs = 30}};
        file = train_tree(bar.body, data, config);
        calibrate(file, data, {.miss_rate = 0.02});
        tree = std::make_shared<const CollisionTree>(file.tree);
        held_out = frames_of(data, file.facts.split, FrameSet::held_out);
    }

    /// Poses the tree as in each held-out frame and calls look(x), with the positions of the surface.
    template <class Posed, class Look>
    void for_each_pose(Posed& posed, const Look& look) const {
        const RecordingReader data(folder / "data.h5");
        Vertices nodes, x;
        for (const FrameId& frame : held_out) {
            data.read(frame.trajectory, frame.frame, 1, nodes);
            apply_embedding(bar.body.W, nodes, x);
            posed.begin_pose(x);
            look(x);
        }
    }

    Bar bar{8, 5};
    TreeFile file;
    std::shared_ptr<const CollisionTree> tree;
    std::vector<FrameId> held_out;
};

TEST_F(Coverage, UsesTheCalibrationTrajectories) {
    for (const BoundKind kind : {BoundKind::nbd, BoundKind::learned_affine}) {
        const Calibration& calibration = file.tree.calibrations.at(kind);
        EXPECT_EQ(calibration.trajectories, 15);
        EXPECT_EQ(calibration.poses, 15 * 12);
        EXPECT_EQ(calibration.miss_rate, 0.02);
        EXPECT_EQ(calibration.confidence, 0.9);
        EXPECT_EQ(calibration.limits.size(), bound_count(*tree, kind));
        EXPECT_GT(std::ranges::max(calibration.margins), 0);
    }
    EXPECT_LT(std::ranges::max(file.tree.calibrations.at(BoundKind::nbd).margins), 0.5);
    EXPECT_EQ(file.tree.calibrations.size(), 3u);  // also of `bd`
}

TEST_F(Coverage, OfBoxesAgreesWithADirectCount) {
    std::ranges::fill(file.tree.calibrations.at(BoundKind::learned_affine).margins, 0.f);
    LearnedAffineFit fit = file.tree.learned_affine->fit();
    for (BoxFit& box : fit.clusters) box.growth = 0;
    file.tree.learned_affine =
        std::make_shared<const LearnedAffineModel>(file.tree.boxes->tree(), std::move(fit));
    const auto bare = std::make_shared<const CollisionTree>(file.tree);
    const RecordingReader data(folder / "data.h5");
    const auto rows = measure_coverage(bar.body, bare, BoundKind::learned_affine, data, held_out);
    ASSERT_EQ(rows.size(), 3u);
    PosedTree body(bare, BoundKind::learned_affine);
    PosedWideTree& posed = body.wide_tree();
    const WideTree& wide = posed.tree();
    double missing = 0;
    long outside = 0, vertices = 0;
    for_each_pose(posed, [&](const Vertices& x) {
        for (int c = 0; c < wide.clusters(); ++c) {
            const Box box = posed.cluster(c);
            const std::size_t of = c;
            long of_cluster = 0;
            for (int leaf = tree_width * wide.first_block[of]; leaf < tree_width * wide.first_block[of + 1];
                 ++leaf)
                for (const int v : wide.leaf_vertices(leaf)) {
                    const Eigen::Array3f p = x.row(v).transpose();
                    of_cluster += (p < box.lo.head<3>()).any() || (p > box.hi.head<3>()).any();
                    ++vertices;
                }
            outside += of_cluster;
            missing += of_cluster > 0;
        }
    });
    EXPECT_GT(missing, 0);
    EXPECT_NEAR(rows[0].nodes_missing,
                missing / static_cast<double>(held_out.size() * static_cast<std::size_t>(wide.clusters())),
                1e-9);
    EXPECT_NEAR(rows[0].vertices_outside, static_cast<double>(outside) / static_cast<double>(vertices),
                1e-12);
    EXPECT_LT(rows[0].inflation, 0);
    EXPECT_GT(rows[0].inflation, -0.5);
}

TEST_F(Coverage, OfSpheresAgreesWithADirectCount) {
    const RecordingReader data(folder / "data.h5");
    const auto rows = measure_coverage(bar.body, tree, BoundKind::nbd, data, held_out);
    ASSERT_EQ(rows.size(), 4u);
    // Counts depth 3 directly.
    PosedTree posed(tree, BoundKind::nbd);
    double missing = 0, inflation = 0;
    for_each_pose(posed, [&](const Vertices& x) {
        for (int i = 7; i < 15; ++i) {
            const Sphere s = posed.sphere(i);
            float farthest = 0, exact = 0;
            Eigen::RowVector3f mean = Eigen::RowVector3f::Zero();
            const auto vertices = tree->spheres.node_vertices(i);
            for (const int v : vertices) mean += x.row(v) / static_cast<float>(vertices.size());
            for (const int v : vertices) {
                farthest = std::max(farthest, (x.row(v).transpose() - s.c).norm());
                exact = std::max(exact, (x.row(v) - mean).norm());
            }
            missing += farthest > s.r;
            inflation += s.r / exact - 1;
        }
    });
    const double all = static_cast<double>(held_out.size()) * 8;
    EXPECT_NEAR(rows[3].nodes_missing, missing / all, 1.5 / all);
    EXPECT_NEAR(rows[3].inflation, inflation / all, 1e-4);
    EXPECT_GT(rows[3].inflation, 0);
    for (const CoverageRow& row : rows) {
        EXPECT_EQ(row.trajectories, 15);
        EXPECT_LE(row.nodes_missing_mean.low, row.nodes_missing);
        EXPECT_GE(row.nodes_missing_mean.high, row.nodes_missing);
        EXPECT_LE(row.keeping_share.low, row.keeping / 15.0);
        // Of 15; the stated share is 0.9, so that fewer have a chance of 0.2 %: processors round differently.
        EXPECT_GE(row.keeping, 10) << row.depth;
    }
    const std::string csv = to_csv(rows), text = to_text(rows);
    EXPECT_EQ(std::ranges::count(csv, '\n'), 5);
    EXPECT_NE(text.find("nbd bounds as calibrated, 180 poses of 15 trajectories; stated: at most 2 %"),
              std::string::npos);
}

TEST_F(Coverage, CountsEveryVertexOutsideOfSpheresThatAreTooSmall) {
    file.tree.nbd->out_centre.row(3).array() -= 0.02f;
    const auto shrunken = std::make_shared<const CollisionTree>(file.tree);
    const RecordingReader data(folder / "data.h5");
    const auto rows = measure_coverage(bar.body, shrunken, BoundKind::nbd, data, held_out);
    PosedTree posed(shrunken, BoundKind::nbd);
    long outside = 0, all = 0;
    for_each_pose(posed, [&](const Vertices& x) {
        for (int i = 7; i < 15; ++i)
            for (const int v : shrunken->spheres.node_vertices(i)) {
                const double r = posed.sphere(i).r;
                outside += (x.row(v).transpose() - posed.sphere(i).c).cast<double>().squaredNorm() > r * r;
                ++all;
            }
    });
    EXPECT_GT(outside, 10);
    EXPECT_NEAR(rows[3].vertices_outside, static_cast<double>(outside) / static_cast<double>(all), 1e-9);
}

TEST_F(Coverage, OfLearnedAffineBoundsHoldsFarOutOfDistribution) {
    std::vector<Vertices> poses;
    for (int f = 0; f < 10; ++f) poses.emplace_back(bar.frame(2, 3, f)).col(1) *= 0.02f;
    const RecordingReader flat = bar.recorded(folder / "flat.h5", poses);
    for (const CoverageRow& row :
         measure_coverage(bar.body, tree, BoundKind::learned_affine, flat, complete_frames(flat))) {
        if (row.depth == 0) {  // the maps of the other levels fit flat poses
            EXPECT_GT(row.out_of_range, 0.5);
        }
        EXPECT_EQ(row.nodes_missing, 0) << row.depth;
    }
}

TEST_F(Coverage, OfNbdBoundsHoldsFarOutOfDistribution) {
    const RecordingReader data(folder / "data.h5");
    for (const CoverageRow& row : measure_coverage(bar.body, tree, BoundKind::nbd, data, held_out))
        EXPECT_LT(row.out_of_range, 0.3) << row.depth;
    // Bends and stretches the bar well beyond the training poses.
    std::vector<Vertices> poses;
    for (int f = 0; f < 10; ++f)
        poses.push_back(bar.pose(2.5 + 0.1 * f, 1.5, 0.5, Eigen::Quaterniond::Identity(), {0, 0, 0}));
    const RecordingReader far = bar.recorded(folder / "far.h5", poses);
    for (const CoverageRow& row :
         measure_coverage(bar.body, tree, BoundKind::nbd, far, complete_frames(far))) {
        EXPECT_EQ(row.out_of_range, 1) << row.depth;
        EXPECT_EQ(row.nodes_missing, 0) << row.depth;
    }
}

TEST_F(Coverage, NeedsACalibrationAndFrames) {
    const RecordingReader data(folder / "data.h5");
    EXPECT_EQ(error_of([&] { measure_coverage(bar.body, tree, BoundKind::exact, data, held_out); }),
              "exact bounds never miss, so they have no coverage to measure");
    EXPECT_EQ(error_of([&] { measure_coverage(bar.body, tree, BoundKind::learned_affine, data, {}); }),
              "no frame to measure coverage on");
    TreeFile none = file;
    none.facts.split.calibration_trajectories.clear();
    EXPECT_NE(error_of([&] { calibrate(none, data, {}); }).find("no trajectories to calibrate on"),
              std::string::npos);
}

TEST_F(Coverage, CalibratesOnHalvesOfAnotherRecording) {
    bar.record(folder / "other.h5", 20, 10, 77);
    calibrate(file, RecordingReader(folder / "other.h5"), {.miss_rate = 0.1, .confidence = 0.5});
    const Calibration& calibration = file.tree.calibrations.at(BoundKind::learned_affine);
    EXPECT_EQ(calibration.trajectories, 10);
    EXPECT_EQ(calibration.confidence, 0.5);
}

TEST_F(Coverage, ContactScenesCountMissedPairs) {
    const RecordingReader data(folder / "data.h5");
    auto shrunk = std::make_shared<CollisionTree>(file.tree);
    Calibration& calibration = shrunk->calibrations.at(BoundKind::nbd);
    std::ranges::fill(calibration.margins, 0.f);
    std::ranges::fill(calibration.limits, 1e9f);
    shrunk->nbd->out_centre.row(3).array() -= 0.2f;
    shrunk->bd.reset();
    shrunk->calibrations.erase(BoundKind::bd);
    const BoundKind kinds[] = {BoundKind::exact, BoundKind::nbd, BoundKind::bd};
    const ContactScenesConfig config{.scenes = 30};
    const auto run = [&] { return check_contact_scenes(bar.body, shrunk, kinds, data, held_out, config); };
    const auto rows = run();
    ASSERT_EQ(rows.size(), 2u);  // the tree has no BD-Tree
    EXPECT_EQ(rows[0].bound, BoundKind::exact);
    EXPECT_EQ(rows[0].missed, 0);
    EXPECT_EQ(rows[0].leaf_pairs, rows[0].exact_leaf_pairs);
    EXPECT_GE(rows[0].scenes, 25);
    EXPECT_GT(rows[0].face_pairs, 200);
    EXPECT_EQ(rows[1].face_pairs, rows[0].face_pairs);
    EXPECT_GT(rows[1].missed, 10);
    EXPECT_GT(rows[1].scenes_missing, 1);
    EXPECT_LT(rows[1].missed, rows[1].face_pairs);
    const double share = static_cast<double>(rows[1].missed) / static_cast<double>(rows[1].face_pairs);
    EXPECT_LE(rows[1].missed_share.low, share);
    EXPECT_GE(rows[1].missed_share.high, share);
    const auto again = test::on_threads(2, run);
    EXPECT_EQ(to_csv(again), to_csv(rows));

    const auto calibrated =
        check_contact_scenes(bar.body, tree, std::span(kinds).first(2), data, held_out, config);
    EXPECT_LT(calibrated[1].missed, rows[1].missed / 10);
    EXPECT_EQ(error_of([&] { check_contact_scenes(bar.body, tree, kinds, data, held_out, {.scenes = 0}); }),
              "0 contact scenes 0.1 radii deep; allowed: 1 or more, and above 0 to 1");
}

}  // namespace
}  // namespace nbd
