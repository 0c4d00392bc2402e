#include "training/learn/train_learned.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "collision/bounds/learned/learned_spheres.hpp"
#include "collision/geometry/bounding_sphere.hpp"
#include "tests/support/error_of.hpp"
#include "tests/support/file_damage.hpp"
#include "tests/support/on_threads.hpp"
#include "tests/training/bar.hpp"

namespace nbd {
namespace {

using test::Bar;

/// A bar with 12 training trajectories of 25 frames and 4 unseen trajectories.
class TrainLearned : public test::FileTest {
 protected:
    void SetUp() override {
        test::FileTest::SetUp();
        bar.record(folder / "data.h5", 12, 25, 2);
        bar.record(folder / "other.h5", 4, 25, 99);
    }
    LearnedModel train(const LearnedConfig& config) const {
        const RecordingReader data(folder / "data.h5");
        FrameSource source(bar.body.W, data);
        return train_learned(bar.body, tree, source, complete_frames(data), config);
    }
    /// Calls f(node, sphere, ood_score, exact sphere) for all nodes in all frames of a recording.
    template <class F>
    void visit(const LearnedModel& model, const char* file, F&& f) const {
        const RecordingReader data(folder / file);
        const auto frames = complete_frames(data);
        Vertices nodes, x;
        for (const FrameId& frame : frames) {
            data.read(frame.trajectory, frame.frame, 1, nodes);
            apply_embedding(bar.body.W, nodes, x);
            LearnedSpheres bound(model);
            bound.begin_pose(x);
            for (int i = 0; i < static_cast<int>(tree.nodes.size()); ++i) {
                const Sphere sphere = bound.bound(i);
                f(i, sphere, bound.ood_score(i), bounding_sphere(x, tree.node_vertices(i)), x);
            }
        }
    }
    double radius_error(const LearnedModel& model) const {
        double sum = 0, count = 0;
        visit(model, "other.h5", [&](int, const Sphere& s, float, const Sphere& exact, const Vertices&) {
            sum += std::abs(double{s.r} / double{exact.r} - 1);
            ++count;
        });
        return sum / count;
    }

    Bar bar{0, 8};
    SphereTree tree = build_sphere_tree(bar.body.X, bar.body.F, {.depth = 4});
};

TEST_F(TrainLearned, TakesEachNodesSamplesFromItsOwnVertices) {
    for (const SampleRule rule : {SampleRule::spread, SampleRule::support}) {
        const LearnedModel model = train({.samples = {.rule = rule, .count = 32, .exact_vertices = 128}});
        check_learned_model(model, tree, static_cast<int>(bar.body.X.rows()));
        int exact = 0;
        for (int i = 0; i < static_cast<int>(tree.nodes.size()); ++i) {
            const LearnedModel::Node& node = model.nodes[static_cast<std::size_t>(i)];
            const std::span<const int> vertices = tree.node_vertices(i);
            const std::set<int> own(vertices.begin(), vertices.end());
            std::set<int> samples(model.samples.begin() + node.sample_begin,
                                  model.samples.begin() + node.sample_begin + node.sample_count);
            EXPECT_TRUE(std::ranges::includes(own, samples)) << i;
            EXPECT_EQ(node.exact, own.size() <= 128) << i;
            EXPECT_EQ(samples.size(), node.exact ? own.size() : 32) << i;
            exact += node.exact;
        }
        EXPECT_TRUE(exact > 0 && exact < static_cast<int>(tree.nodes.size())) << exact;
    }
}

TEST_F(TrainLearned, IsAccurateOnUnseenTrajectories) {
    const double spread = radius_error(train({.samples = {.rule = SampleRule::spread, .count = 16}})),
                 support = radius_error(train({.samples = {.count = 16}})),
                 by_tolerance = radius_error(train({.samples = {.tolerance = 0.001}})),
                 network = radius_error(train({.samples = {.rule = SampleRule::spread, .count = 16},
                                               .network = true,
                                               .networks = {.batch = 32}}));
    EXPECT_LT(spread, 0.02);
    EXPECT_LT(support, 0.5 * spread);
    EXPECT_LT(by_tolerance, 0.002);
    EXPECT_LT(network, spread);
}

TEST_F(TrainLearned, BoundsSmallNodesExactly) {
    const LearnedModel model = train({.samples = {.exact_vertices = 128}});
    int exact_nodes = 0;
    visit(model, "other.h5",
          [&](int i, const Sphere& s, float ood_score, const Sphere& exact, const Vertices& x) {
              if (!model.nodes[static_cast<std::size_t>(i)].exact) return;
              ++exact_nodes;
              EXPECT_EQ(ood_score, 0);
              EXPECT_NEAR(s.r, exact.r, 1e-5);
              EXPECT_NEAR((s.c - exact.c).norm(), 0, 1e-5);
              for (const int v : tree.node_vertices(i)) EXPECT_LE((x.row(v).transpose() - s.c).norm(), s.r);
          });
    EXPECT_GT(exact_nodes, 1000);
}

TEST_F(TrainLearned, ScoresUnusualPosesHigherThanTrainingPoses) {
    const LearnedModel model = train({});
    float known = 0;
    visit(model, "data.h5", [&](int, const Sphere&, float ood_score, const Sphere&, const Vertices&) {
        known = std::max(known, ood_score);
    });
    EXPECT_GT(known, 1);  // in standard deviations
    EXPECT_LT(known, 10);
    Vertices x;
    apply_embedding(bar.body.W, bar.pose(0, 0, 1.5, Eigen::Quaterniond::Identity(), {0, 0, 0}), x);
    EXPECT_GT(learned_sphere(model, 0, x).ood_score, 1.5f * known);
    x = bar.body.X;
    x.col(1) *= 0.01f;
    float flat = 0;
    for (int i = 0; i < 3; ++i) flat = std::max(flat, learned_sphere(model, i, x).ood_score);
    EXPECT_GT(flat, known);
}

TEST_F(TrainLearned, BoxesKeepTheGivenMissRate) {
    const RecordingReader data(folder / "data.h5");
    FrameSource source(bar.body.W, data);
    const auto frames = complete_frames(data);
    for (const double miss_rate : {0., 0.1}) {
        LearnedConfig config{.samples = {.rule = SampleRule::spread, .count = 16},
                             .box_miss_rate = miss_rate};
        LearnedModel model = choose_samples(bar.body, tree, source, frames, config);
        const SampleReach reach = measure_reach(tree, model, source, frames, 5, false);
        fit_sample_reach(reach, config, model);
        int wide = 0;
        for (int i = 0; i < static_cast<int>(tree.nodes.size()); ++i) {
            if (model.nodes[static_cast<std::size_t>(i)].exact) continue;
            const auto missed =
                (reach.box.col(i).array() > model.boxes[static_cast<std::size_t>(i)].growth).count();
            EXPECT_LE(static_cast<double>(missed), miss_rate * static_cast<double>(frames.size())) << i;
            wide += static_cast<double>(missed) > 0.9 * miss_rate * static_cast<double>(frames.size()) - 1;
        }
        EXPECT_GT(wide, 5);
    }
}

TEST_F(TrainLearned, GivesTheSameBitsOnAnyNumberOfThreads) {
    for (const bool network : {false, true}) {
        const auto run = [&] { return train({.network = network, .networks = {.epochs = 3}}); };
        const LearnedModel one = test::on_threads(1, run), two = test::on_threads(2, run);
        EXPECT_EQ(one.samples, two.samples);
        EXPECT_EQ(one.values, two.values);
    }
}

TEST_F(TrainLearned, RejectsInvalidOptionsAndMissingPoses) {
    const auto error = [&](const LearnedConfig& config) { return test::refusal([&] { train(config); }); };
    EXPECT_EQ(error({.samples = {.count = 17}}),
              "samples of a node: 17; allowed: 0 or a multiple of 16 up to 128");
    EXPECT_EQ(error({.samples = {.max_count = 0}}),
              "maximum samples of a node: 0; allowed: a multiple of 16 up to 128");
    EXPECT_EQ(error({.samples = {.exact_vertices = 129}}),
              "maximum vertices of an exact node: 129; allowed: 16 to 128");
    EXPECT_EQ(error({.samples = {.tolerance = -1}}), "tolerance of the samples -1; allowed: 0 or more");
    EXPECT_EQ(error({.sample_poses = 0}), "0 poses to choose samples from, at least 1 needed");
    EXPECT_EQ(error({.networks = {.epochs = 0}}), "epochs of a radius network: 0; allowed: 1 or more");
    EXPECT_EQ(error({.networks = {.quantile = 1}}), "quantile of a radius network 1; allowed: [0, 1)");
    EXPECT_EQ(error({.box_miss_rate = 1}), "miss rate of boxes 1; allowed: [0, 1)");
    const RecordingReader data(folder / "data.h5");
    FrameSource source(bar.body.W, data);
    EXPECT_EQ(test::refusal([&] { train_learned(bar.body, tree, source, {}, {}); }),
              "no pose to choose samples from");
}

}  // namespace
}  // namespace nbd
