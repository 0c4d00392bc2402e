#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <vector>

#include "apps/bench/pairs/lazy_boxes.hpp"
#include "apps/bench/pairs/pair_method.hpp"
#include "apps/bench/pairs/race.hpp"
#include "apps/bench/pairs/touching_scenes.hpp"
#include "tests/support/brute_force.hpp"
#include "tests/support/error_of.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/training/bar.hpp"

namespace nbd {
namespace {

using test::Bar;
using test::brute_force_intersecting;
using test::error_of;

/// Bars of two resolutions on the same nodes, with touching scenes.
class BenchPairs : public ::testing::Test {
 protected:
    static void SetUpTestSuite() {
        folder_ = std::make_unique<test::TemporaryFolder>();
        coarse_ = std::make_unique<BenchBody>(make_bench_body(Bar(0, 4).body));
        fine_ = std::make_unique<BenchBody>(make_bench_body(Bar(0, 8).body));
        Bar(0, 4).record(*folder_ / "data.h5", 6, 12, 3);
        scenes_ = make_touching_scenes(*coarse_, recording(), complete_frames(recording()),
                                       {.scenes = 4, .pairs = 8});
    }
    static void TearDownTestSuite() {
        folder_.reset();
        coarse_.reset();
        fine_.reset();
    }
    static RecordingReader recording() { return RecordingReader(*folder_ / "data.h5"); }

    /// Pairs that a method finds in each scene, each time after another pose.
    static std::vector<std::vector<FacePair>> answers(const BenchBody& body, const PairMethodEntry& entry) {
        const auto method = entry.make(body);
        Vertices a, b, nodes_a, nodes_b;  // reused for all poses, as in the benchmark
        std::vector<std::vector<FacePair>> found;
        for (const TouchingScene& scene : scenes_) {
            nodes_a = scene.a;
            nodes_b = scene.b;
            apply_embedding(body.surface.W, nodes_a, a);
            apply_embedding(body.surface.W, nodes_b, b);
            method->update({a, nodes_a}, {b, nodes_b});
            const std::span<const FacePair> pairs = method->query();
            found.emplace_back(pairs.begin(), pairs.end());
        }
        return found;
    }
    static std::vector<std::vector<FacePair>> truth(const BenchBody& body) {
        std::vector<std::vector<FacePair>> pairs;
        for (const TouchingScene& scene : scenes_) {
            Vertices a, b;
            apply_embedding(body.surface.W, scene.a, a);
            apply_embedding(body.surface.W, scene.b, b);
            pairs.push_back(brute_force_intersecting(a, body.surface.F, b, body.surface.F));
        }
        return pairs;
    }

    static inline std::unique_ptr<test::TemporaryFolder> folder_;
    static inline std::unique_ptr<BenchBody> coarse_, fine_;
    static inline std::vector<TouchingScene> scenes_;
};

TEST_F(BenchPairs, ScenesAreReproducibleAndTouchAsRequested) {
    const TouchingScenesConfig config{.scenes = 4, .pairs = 8};
    const auto again = make_touching_scenes(*coarse_, recording(), complete_frames(recording()), config);
    ASSERT_EQ(again.size(), 4U);
    const auto pairs = truth(*coarse_);
    for (std::size_t s = 0; s < again.size(); ++s) {
        EXPECT_EQ(again[s].a, scenes_[s].a);
        EXPECT_EQ(again[s].b, scenes_[s].b);
        EXPECT_GE(scenes_[s].pairs, 8);
        EXPECT_LE(scenes_[s].pairs, 12);
        // Scenes move nodes rather than the surface, which rounds differently.
        EXPECT_NEAR(static_cast<double>(pairs[s].size()), scenes_[s].pairs, 2);
    }
    EXPECT_NE(again[0].a, again[1].a);
    auto other = config;
    other.seed = 2;
    EXPECT_NE(make_touching_scenes(*coarse_, recording(), complete_frames(recording()), other)[0].b,
              scenes_[0].b);
}

TEST_F(BenchPairs, LazyBoxesAgreeWithBruteForce) {
    const auto expected = truth(*fine_);
    ASSERT_GT(expected[0].size(), 8U);
    for (const int cluster_faces : {1, 5, 60, 256, 1024})
        EXPECT_EQ(answers(*fine_, lazy_boxes_method(cluster_faces)), expected) << cluster_faces;
    const std::string refusal = error_of([] { LazyBoxes(coarse_->surface.X, coarse_->surface.F, 0); });
    EXPECT_EQ(refusal, "clusters of 0 faces, allowed: 1 to 4096");
}

TEST_F(BenchPairs, ExactBoundsAgreeWithBruteForce) {
    const auto expected = truth(*fine_);
    for (const PairMethodEntry& method : tree_methods(*fine_))
        EXPECT_EQ(answers(*fine_, method), expected) << method.name;
}

TEST_F(BenchPairs, EmbreeAgreesWithBruteForce) {
    if (embree_methods().empty()) GTEST_SKIP() << "embree was not found when this program was built";
    const auto expected = truth(*fine_);
    for (const PairMethodEntry& method : embree_methods())
        EXPECT_EQ(answers(*fine_, method), expected) << method.name;
}

TEST_F(BenchPairs, ARaceCountsMissedPairs) {
    struct Half final : PairMethod {
        std::unique_ptr<PairMethod> whole;
        void update(const BenchPose& a, const BenchPose& b) override { whole->update(a, b); }
        std::span<const FacePair> query() override {
            const auto all = whole->query();
            return all.subspan(0, all.size() / 2);
        }
    };
    const PairMethodEntry half{"half", false, false, [](const BenchBody& body) {
                                   auto method = std::make_unique<Half>();
                                   method->whole = lazy_boxes_method(64).make(body);
                                   return method;
                               }};
    const PairMethodEntry broken{"broken", true, false, [](const BenchBody&) -> std::unique_ptr<PairMethod> {
                                     throw std::runtime_error("does not start");
                                 }};
    std::vector<std::string> turns;
    double done = 0;
    const auto rows = race(*coarse_, {tree_method(BoundKind::boxes), lazy_boxes_method(64), half, broken},
                           scenes_, {.rounds = 8}, [&](const std::string& method, double share) {
                               turns.push_back(method);
                               EXPECT_GE(share, done);
                               done = share;
                           });
    ASSERT_EQ(rows.size(), 4U);
    const auto begin = turns.begin() + 4;
    EXPECT_EQ(std::vector(turns.begin(), begin),
              std::vector<std::string>({"boxes", "lazy boxes 64", "half", "broken"}));
    ASSERT_EQ(turns.size(), 4U + 8 * 3);
    std::set<std::vector<std::string>> orders;
    for (auto round = begin; round != turns.end(); round += 3) {
        orders.insert(std::vector(round, round + 3));
        EXPECT_EQ(std::set<std::string>(round, round + 3).size(), 3U) << "one turn a round for each";
        EXPECT_EQ(std::count(round, round + 3, "broken"), 0);
    }
    EXPECT_GT(orders.size(), 2U) << "in other orders";
    EXPECT_EQ(done, 1);
    EXPECT_EQ(rows[1].missed + rows[1].invented, 0);
    EXPECT_GT(rows[1].pairs, 8);
    EXPECT_GT(rows[1].total_us, 0);
    EXPECT_NEAR(rows[2].recall(), 0.5, 0.1);
    EXPECT_EQ(rows[3].failure, "does not start");
    const Rows table = to_rows("light", rows);
    ASSERT_EQ(table.size(), rows.size());
    for (std::size_t i = 1; i < table.size(); ++i) EXPECT_LE(table[i - 1]["total_us"], table[i]["total_us"]);
    const std::string text = to_text(table, {"contact", "method", "failure"});
    EXPECT_EQ(text.substr(0, text.find('\n')), "contact  method         failure");
    EXPECT_NE(text.find("light    broken         does not start"), std::string::npos) << text;
}

TEST_F(BenchPairs, RejectsImpossibleScenes) {
    EXPECT_NE(error_of([] { make_touching_scenes(*coarse_, recording(), {}, {}); }), "");
    const auto frames = complete_frames(recording());
    EXPECT_NE(error_of([&] {
                  make_touching_scenes(*coarse_, recording(), frames, {.scenes = 1, .pairs = 100000});
              }),
              "");
    EXPECT_NE(error_of([] { recorded_scenes(*coarse_, recording(), 0.1f, 3); }).find("two copies"),
              std::string::npos);
    std::vector<BenchBody> bodies{*coarse_};
    bodies[0].split.train_trajectories = {0, 1, 2, 3, 4, 5};
    EXPECT_NE(error_of([&] { unseen_frames(bodies, recording()); }).find("no trajectory was held out"),
              std::string::npos);
    bodies[0].split.train_trajectories = {0, 1, 2};
    bodies[0].split.held_out_trajectories = {4};
    const auto unseen = unseen_frames(bodies, recording());
    ASSERT_EQ(unseen.size(), 12U);
    EXPECT_EQ(unseen.front().trajectory, 4);
}

TEST_F(BenchPairs, UsesRecordedFramesWithNearbyBodies) {
    {
        RecordingWriter writer(*folder_ / "scene.h5");
        for (int id = 0; id < 2; ++id) {
            TrajectoryInfo info;
            info.id = id;
            info.body_hash = coarse_->surface.hash;
            const int handle = writer.begin_trajectory(info, Bar::nodes);
            for (int f = 0; f < 10; ++f) {
                Vertices x = Bar(0, 4).frame(1, id, 0);
                x.rowwise() -= x.colwise().mean().eval();
                x.col(2).array() += static_cast<float>(id * f);
                writer.add_frame(handle, 0.1 * f, x);
            }
            writer.end_trajectory(handle);
        }
        writer.finish();
    }
    const RecordingReader scene(*folder_ / "scene.h5");
    const auto near = recorded_scenes(*coarse_, scene, 0.01f, 100);
    EXPECT_GE(near.size(), 1U);
    EXPECT_LT(near.size(), 10U);
    EXPECT_EQ(recorded_scenes(*coarse_, scene, 0.01f, 1).size(), 1U);
}

}  // namespace
}  // namespace nbd
