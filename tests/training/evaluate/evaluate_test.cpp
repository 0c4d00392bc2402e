#include "training/evaluate/evaluate.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "collision/base/notice.hpp"
#include "collision/nbd_tree/sphere_tree.hpp"
#include "collision/tree/posed_tree.hpp"
#include "tests/support/error_of.hpp"
#include "tests/support/file_damage.hpp"
#include "tests/support/on_threads.hpp"
#include "tests/training/bar.hpp"
#include "training/calibrate/calibrate.hpp"
#include "training/files/recording_hash.hpp"
#include "training/learn/train_tree.hpp"

namespace nbd {
namespace {

using test::Bar;
using test::error_of;

/// One small tree, shared by all tests of this file.
class Evaluate : public testing::Test {
 protected:
    static void SetUpTestSuite() {
        own = std::make_unique<test::TemporaryFolder>();
        folder = own->path();
        bar = new Bar(12, 3);
        bar->record(folder / "data.h5", 12, 80, 2);
        bar->record(folder / "other.h5", 3, 20, 77);
        const RecordingReader data(folder / "data.h5");
        tree = new TreeFile(train_tree(bar->body, data,
                                       {.tree = {.depth = 3},
                                        .clusters = {.k_means = {.clusters = 60}, .initialisations = 1},
                                        .mlp = {.batch = 32, .max_epochs = 80}}));
    }
    static void TearDownTestSuite() {
        own.reset();
        delete tree;
        delete bar;
    }
    static std::vector<EvaluationRow> rows_of(const char* file, const EvaluateConfig& config = {}) {
        return evaluate(*tree, RecordingReader(folder / file), config);
    }
    static const EvaluationRow& find(const std::vector<EvaluationRow>& rows, std::string_view frames,
                                     BoundKind bound, int depth, double margin) {
        const auto row = std::ranges::find_if(rows, [&](const EvaluationRow& r) {
            return r.frames == frames && r.bound == bound && r.depth == depth && r.margin == margin;
        });
        if (row == rows.end()) throw std::out_of_range("no such row");
        return *row;
    }

    /// A recording of some trajectories of data.h5, as `info` names them: `count` frames of each, from
    /// `first` on, every `step`th one, moved by `by` metres. source: what it was remapped from.
    static RecordingReader copied(const char* name, const std::vector<std::pair<int, TrajectoryInfo>>& infos,
                                  int count, int first, int step, float by, const std::string& source = {}) {
        const RecordingReader data(folder / "data.h5");
        RecordingWriter writer(folder / name);
        if (!source.empty()) writer.label("remapped_from_sha256", source);
        Vertices x;
        for (const auto& [trajectory, info] : infos) {
            const int handle = writer.begin_trajectory(info, Bar::nodes);
            for (int f = 0; f < count; ++f) {
                data.read(trajectory, first + step * f, 1, x);
                writer.add_frame(handle, f, (x.array() + by).matrix());
            }
            writer.end_trajectory(handle);
        }
        writer.finish();
        return RecordingReader(folder / name);
    }
    static TrajectoryInfo info_of(int id, std::uint64_t seed) {
        return {.id = id, .seed = seed, .body_hash = bar->body.hash, .recipe = "{}", .failure = {}};
    }

    static inline std::unique_ptr<test::TemporaryFolder> own;
    static inline std::filesystem::path folder;
    static inline Bar* bar = nullptr;
    static inline TreeFile* tree = nullptr;
};

TEST_F(Evaluate, ExactSpheresContainEverythingAndHaveNoError) {
    const auto rows = rows_of("data.h5");
    for (const EvaluationRow& r : rows) {
        if (r.bound != BoundKind::exact) continue;
        EXPECT_EQ(r.vertices_outside, 0);
        EXPECT_EQ(r.nodes_missing, 0);
        EXPECT_NEAR(r.radius_error, r.margin, 1e-5);
        EXPECT_NEAR(r.centre_error, 0, 1e-5);
    }
}

TEST_F(Evaluate, NamesBothSetsAndCountsPosesNodesAndVertices) {
    const auto rows = rows_of("data.h5");
    EXPECT_EQ(rows.size(),
              2u * 5u * (3u * 4u + 3u));  // sets, margins, depths of three bounds, levels of boxes
    const RecordingReader data(folder / "data.h5");
    const auto& split = tree->facts.split;
    for (const auto& [name, set] : {std::pair("random frames", FrameSet::random_test),
                                    std::pair("held-out trajectories", FrameSet::held_out)}) {
        const long poses = frames_of(data, split, set).size();
        ASSERT_GT(poses, 0);
        const EvaluationRow& r = find(rows, name, BoundKind::nbd, 3, 0.02);
        EXPECT_EQ(r.poses, poses);
        EXPECT_EQ(r.nodes, 8 * poses);
        EXPECT_GE(r.vertices, bar->body.X.rows() * poses);
    }
}

TEST_F(Evaluate, KeepsTheSplitForPartOfARemappedRecording) {
    const int held_out = tree->facts.split.held_out_trajectories.at(0),
              trained = tree->facts.split.train_trajectories.at(0);
    const auto copy = [&](const char* name, const std::string& source) {
        return copied(name, {{held_out, info_of(held_out, 0)}, {trained, info_of(trained, 0)}}, 5, 0, 1, 0,
                      source);
    };
    const RecordingReader remapped = copy("remapped.h5", tree->facts.recording_hash);
    const auto sets = test_frames(*tree, remapped);
    EXPECT_EQ(sets.back().name, "held-out trajectories");
    ASSERT_EQ(sets.back().frames.size(), 5u);
    for (const FrameId& frame : sets.back().frames)
        EXPECT_EQ(remapped.trajectories()[frame.trajectory].id, held_out);
    const auto foreign = test_frames(*tree, copy("foreign.h5", std::string(64, '0')));
    ASSERT_EQ(foreign.size(), 1u);
    EXPECT_EQ(foreign[0].name, "other recording");
    EXPECT_EQ(foreign[0].frames.size(), 5u) << "one of the two trajectories was trained on";
}

/// Lines that the library told in the last call of `action`.
std::vector<std::string> told_by(const std::function<void()>& action) {
    static std::vector<std::string> lines;
    lines.clear();
    set_notice_handler([](std::string_view line) { lines.emplace_back(line); });
    action();
    set_notice_handler(nullptr);
    return lines;
}

TEST_F(Evaluate, LeavesOutTrajectoriesThatTheTreeHasSeenInOtherFiles) {
    const TrainingSplit& split = tree->facts.split;
    const int trained = split.train_trajectories.at(0), kept = split.held_out_trajectories.at(0);
    // Every second frame, in another order, under other numbers and seeds; or the same origin and other
    // frames.
    const auto copy = [&](bool same_frames, bool same_origin) {
        return copied("copied.h5",
                      {{trained, same_origin ? info_of(trained, 2) : info_of(50, 9)},
                       {kept, same_origin ? info_of(kept, 2) : info_of(51, 9)}},
                      12, 70, -2, same_frames ? 0 : 0.25f);
    };
    struct Case {
        bool same_frames, same_origin;
        const char* left_out;  // its number in the file
    };
    for (const Case& c : {Case{true, false, "50"}, Case{false, true, nullptr}, Case{false, false, ""}}) {
        const RecordingReader copied = copy(c.same_frames, c.same_origin);
        std::vector<TestFrames> sets;
        const auto told = told_by([&] { sets = test_frames(*tree, copied); });
        const std::string number = c.left_out ? c.left_out : std::to_string(trained);
        ASSERT_EQ(sets.size(), 1u);
        if (number.empty()) {
            EXPECT_EQ(sets[0].frames.size(), 24u);
            EXPECT_TRUE(told.empty());
            continue;
        }
        EXPECT_EQ(sets[0].frames.size(), 12u);
        ASSERT_EQ(told.size(), 1u);
        EXPECT_EQ(told[0], copied.path().string() +
                               ": 1 of 2 trajectories are left out, as the tree was trained or calibrated on "
                               "them: " +
                               number);
        for (const FrameId& frame : sets[0].frames)
            EXPECT_NE(std::to_string(copied.trajectories()[frame.trajectory].id), number);
    }
    // A tree of an earlier release does not know.
    TreeFile old = *tree;
    old.facts.trained_on.reset();
    old.facts.calibrated_on.reset();
    const RecordingReader copied = copy(true, false);
    const auto told = told_by([&] { EXPECT_EQ(test_frames(old, copied)[0].frames.size(), 24u); });
    ASSERT_EQ(told.size(), 1u);
    EXPECT_NE(told[0].find("cannot be checked"), std::string::npos) << told[0];
}

TEST_F(Evaluate, CalibrationLeavesOutWhatTrainingSawAndIsNotTestedOn) {
    // Seed 2 gives the trajectories of the training again, and twelve more.
    bar->record(folder / "longer.h5", 24, 30, 2);
    const RecordingReader longer(folder / "longer.h5");
    TreeFile file = *tree;
    const auto told = told_by([&] { calibrate(file, longer, {.miss_rate = 0.1, .confidence = 0.5}); });
    const std::size_t trained = tree->facts.split.train_trajectories.size();
    ASSERT_EQ(told.size(), 1u);
    EXPECT_NE(told[0].find(std::to_string(trained) + " of 24 trajectories are left out"), std::string::npos)
        << told[0];
    EXPECT_EQ(file.tree.calibrations.at(BoundKind::nbd).trajectories, static_cast<int>((25 - trained) / 2));
    EXPECT_NE(error_of([&] { test_frames(file, longer); }).find("training and calibration saw all of them"),
              std::string::npos);
    EXPECT_EQ(told_by([&] { EXPECT_THROW(test_frames(file, longer), std::runtime_error); }).size(), 1u);
    // Held-out trajectories that calibration has seen since are no test any more.
    const RecordingReader data(folder / "data.h5");
    for (const TestFrames& set : test_frames(file, data)) EXPECT_EQ(set.name, "random frames");
    EXPECT_EQ(test_frames(*tree, data).back().name, "held-out trajectories");
    // Only trained ones: nothing is left to calibrate on.
    bar->record(folder / "same.h5", 12, 30, 2);
    TreeFile all = *tree;
    all.facts.trained_on->origins = seen_trajectories(RecordingReader(folder / "same.h5"),
                                                      hash_recording(RecordingReader(folder / "same.h5")),
                                                      std::vector<int>{0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10})
                                        .origins;
    EXPECT_NE(error_of([&] {
                  calibrate(all, RecordingReader(folder / "same.h5"), {});
              }).find("1 complete trajectories that the tree was not trained on; allowed: at least 2"),
              std::string::npos);
}

TEST_F(Evaluate, NbdBoundsAreTightAndAMarginReducesMisses) {
    const auto rows = rows_of("data.h5");
    for (int depth = 0; depth <= 3; ++depth) {
        const auto& bare = find(rows, "random frames", BoundKind::nbd, depth, 0);
        const auto& wide = find(rows, "random frames", BoundKind::nbd, depth, 0.1);
        EXPECT_LT(bare.radius_error, 0.05);
        EXPECT_GT(bare.radius_error, 0);
        EXPECT_LT(bare.centre_error, 0.1);
        EXPECT_GT(bare.vertices_outside, 0);
        EXPECT_LT(wide.vertices_outside, bare.vertices_outside);
        EXPECT_LT(wide.nodes_missing, bare.nodes_missing);
        EXPECT_GE(bare.nodes_missing, bare.vertices_outside);
    }
}

TEST_F(Evaluate, AgreesWithADirectCount) {
    const RecordingReader data(folder / "other.h5");
    const auto posed_tree = std::make_shared<const CollisionTree>(tree->tree);
    PosedTree posed(posed_tree, BoundKind::nbd, 0.f);
    long outside = 0, vertices = 0;
    double radius_error = 0;
    Vertices x;
    for (int id = 0; id < 3; ++id)
        for (int f = 0; f < 20; ++f) {
            apply_embedding(bar->body.W, bar->frame(77, id, f), x);
            posed.begin_pose(x);
            for (int node = 7; node < 15; ++node) {
                const Sphere s = posed.sphere(node),
                             exact = bounding_sphere(x, tree->tree.spheres.node_vertices(node));
                radius_error += std::abs(s.r - exact.r) / exact.r / (60 * 8);
                for (const int v : tree->tree.spheres.node_vertices(node)) {
                    ++vertices;
                    outside += (x.row(v).transpose() - s.c).cast<double>().norm() > s.r;
                }
            }
        }
    const auto rows = rows_of("other.h5");
    const EvaluationRow& r = find(rows, "other recording", BoundKind::nbd, 3, 0);
    ASSERT_GT(outside, 0);
    EXPECT_EQ(r.vertices, vertices);
    EXPECT_NEAR(r.vertices_outside, static_cast<double>(outside) / static_cast<double>(vertices), 1e-12);
    EXPECT_NEAR(r.radius_error, radius_error, 1e-6);
}

TEST_F(Evaluate, OfLearnedAffineBoxesAgreesWithADirectCount) {
    TreeFile bare = *tree;  // without what training adds to boxes
    LearnedAffineFit fit = bare.tree.learned_affine->fit();
    for (BoxFit& box : fit.clusters) box.growth = 0;
    std::ranges::fill(fit.growth, 0.f);
    bare.tree.learned_affine =
        std::make_shared<const LearnedAffineModel>(bare.tree.boxes->tree(), std::move(fit));
    PosedTree body(refer_to(bare.tree), BoundKind::learned_affine, 0.f);
    PosedWideTree& posed = body.wide_tree();
    const WideTree& wide = posed.tree();
    ASSERT_EQ(wide.clusters(), 1);
    const double margins[] = {0, 0.1};
    long outside[] = {0, 0}, vertices = 0;
    double error = 0, centre_error = 0;
    Vertices x;
    for (int id = 0; id < 3; ++id)
        for (int f = 0; f < 20; ++f) {
            apply_embedding(bar->body.W, bar->frame(77, id, f), x);
            posed.begin_pose(x);
            const Box box = posed.cluster(0);
            const Eigen::Array3f lo = x.colwise().minCoeff().transpose(),
                                 hi = x.colwise().maxCoeff().transpose();
            const double size = double{(hi - lo).matrix().norm()} / 2,
                         half = double{(box.hi - box.lo).head<3>().matrix().norm()} / 2;
            error += std::abs(half - size) / size / 60;
            const Eigen::Array3f c = (box.lo + box.hi).head<3>() / 2;
            centre_error += double{(c - (lo + hi) / 2).matrix().norm()} / size / 60;
            for (int leaf = 0; leaf < wide.leaves(); ++leaf)
                for (const int v : wide.leaf_vertices(leaf)) {
                    ++vertices;
                    const Eigen::Array3f away = (x.row(v).transpose().array() - c).abs();
                    for (std::size_t k = 0; k < 2; ++k)
                        outside[k] += ((away - (1 + static_cast<float>(margins[k])) *
                                                   (box.hi - box.lo).head<3>() / 2) > 1e-6f)
                                          .any();
                }
        }
    const auto rows = evaluate(bare, RecordingReader(folder / "other.h5"),
                               {.bounds = {BoundKind::learned_affine}, .margins = {0, 0.1}});
    ASSERT_EQ(rows.size(), 6u);
    ASSERT_GT(outside[0], 0);
    for (std::size_t k = 0; k < 2; ++k) {
        const EvaluationRow& r = find(rows, "other recording", BoundKind::learned_affine, 0, margins[k]);
        EXPECT_EQ(r.vertices, vertices);
        EXPECT_EQ(r.nodes, 60);
        EXPECT_NEAR(r.vertices_outside, static_cast<double>(outside[k]) / static_cast<double>(vertices),
                    1e-3);
        EXPECT_NEAR(r.centre_error, centre_error, 1e-4);
    }
    EXPECT_NEAR(find(rows, "other recording", BoundKind::learned_affine, 0, 0).radius_error, error, 1e-4);
    for (int level = 0; level < 3; ++level)
        EXPECT_LT(find(rows, "other recording", BoundKind::learned_affine, level, 0.1).nodes_missing,
                  find(rows, "other recording", BoundKind::learned_affine, level, 0).nodes_missing)
            << level;
}

TEST_F(Evaluate, GivesTheSameBitsOnAnyNumberOfThreads) {
    const auto table = [] { return to_csv(rows_of("data.h5")); };
    EXPECT_EQ(test::on_threads(1, table), test::on_threads(2, table));
}

TEST_F(Evaluate, WritesTables) {
    const auto rows = rows_of("data.h5", {.bounds = {BoundKind::nbd}, .margins = {0, 0.02}, .max_frames = 7});
    const std::string csv = to_csv(rows), text = to_text(rows);
    EXPECT_EQ(std::ranges::count(csv, '\n'), 1 + static_cast<long>(rows.size()));
    EXPECT_EQ(csv.find("frames,bound,margin,depth,radius_error"), 0u);
    EXPECT_NE(csv.find("\nheld-out trajectories,nbd,0.02,3,"), std::string::npos);
    EXPECT_NE(text.find("random frames, 7 poses, nbd bounds; % at margins of 0 2 %\n"), std::string::npos);
    EXPECT_EQ(text.find("\n      1  "), std::string::npos);  // of depths 0 to 3
    for (const char* depth : {"\n      0  ", "\n      2  ", "\n      3  "})
        EXPECT_NE(text.find(depth), std::string::npos) << depth;
}

TEST_F(Evaluate, RejectsInvalidInput) {
    EXPECT_EQ(error_of([] { rows_of("data.h5", {.margins = {-0.1}}); }), "margin -0.1; allowed: 0 or more");
    EXPECT_EQ(error_of([] { rows_of("data.h5", {.margins = {}}); }), "no margins to evaluate");
    EXPECT_EQ(
        error_of([] { rows_of("data.h5", {.bounds = {BoundKind::affine}}); }),
        "affine bounds are not those of the tree's nodes, which are evaluated; `nbdtree coverage` measures "
        "them");
    TreeFile other = *tree;
    other.facts.body_hash = std::string(64, 'c');
    const std::string error = error_of([&] { evaluate(other, RecordingReader(folder / "data.h5")); });
    EXPECT_NE(error.find("trajectory 0 is of body bbbbbbbbbbbb, but this body is cccccccccccc"),
              std::string::npos)
        << error;
}

}  // namespace
}  // namespace nbd
