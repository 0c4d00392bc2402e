#include "training/calibrate/calibrate.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <random>
#include <span>
#include <vector>

#include "collision/bounds/calibration.hpp"
#include "tests/support/error_of.hpp"
#include "tests/support/shapes.hpp"
#include "training/calibrate/statistics.hpp"
#include "training/files/split.hpp"

namespace nbd {
namespace {

using test::error_of;

/// Share of the scores above a level.
double rate_above(std::span<const float> scores, float level) {
    const auto above = std::ranges::count_if(scores, [level](float score) { return score > level; });
    return static_cast<double>(above) / static_cast<double>(scores.size());
}

TEST(LevelAtRate, LeavesAtMostTheGivenRateAbove) {
    std::vector<float> scores;
    for (int i = 30; i > 0; --i) scores.push_back(i);
    EXPECT_EQ(level_at_rate(scores, 0), 30);
    EXPECT_EQ(level_at_rate(scores, 0.033), 30);  // fewer than one of 30 may exceed it
    EXPECT_EQ(level_at_rate(scores, 0.1), 27);
    for (const double rate : {0.0, 0.05, 0.1, 0.5}) {
        const float level = level_at_rate(scores, rate);
        EXPECT_LE(rate_above(scores, level), rate + 1e-9);
        EXPECT_GT(rate_above(scores, std::nextafter(level, 0.f)), rate);
    }
}

TEST(ConfidentLevel, IsTheSplitConformalRank) {
    TrajectoryScores scores;
    for (const float worst : {5.f, 1.f, 4.f, 2.f, 3.f, 9.f, 8.f, 7.f, 6.f}) scores.push_back({0, worst, 0});
    EXPECT_EQ(confident_level(scores, 0.1, 0.9), 9);  // rank ceil(10 * 0.9) = 9 of 9
    EXPECT_EQ(confident_level(scores, 0.1, 0.8), 8);
    EXPECT_EQ(confident_level(scores, 0.1, 0.75), 8);
    EXPECT_EQ(confident_level(scores, 0.34, 0.9), 0);  // one of three may miss
    EXPECT_EQ(error_of([&] { confident_level(scores, 0.1, 0.91); }),
              "9 trajectories cannot support a confidence of 0.91; allowed: up to 0.9");
}

TEST(ShareKeptButFor, IsTheQuantileOfTheBetaLaw) {
    // All of K must keep it: the share is Beta(K, 1).
    EXPECT_NEAR(share_kept_but_for(0.05, 12, 0.9), std::pow(0.05, 1.0 / 12), 1e-9);  // 0.779
    EXPECT_NEAR(share_kept_but_for(0.05, 4, max_confidence(4)), std::pow(0.05, 0.25), 1e-9);
    // Quantiles of Beta(37, 4) and Beta(18, 2).
    EXPECT_NEAR(share_kept_but_for(0.05, 40, 0.9), 0.8174131, 1e-7);
    EXPECT_NEAR(share_kept_but_for(0.05, 19, 0.9), 0.7736258, 1e-7);
    EXPECT_EQ(error_of([&] { share_kept_but_for(0.05, 12, 0.95); }),
              "12 trajectories cannot support a confidence of 0.95; allowed: up to 0.9231");
    // Drawn: levels from sets of twelve uniform scores, of which a fresh one keeps a level with that chance.
    std::mt19937 random(5);
    std::uniform_real_distribution<float> uniform;
    int below = 0;
    constexpr int sets = 4000;
    for (int s = 0; s < sets; ++s) {
        TrajectoryScores scores;
        for (int i = 0; i < 12; ++i) scores.push_back({uniform(random)});
        below += confident_level(scores, 0, 0.8) < share_kept_but_for(0.05, 12, 0.8);
    }
    EXPECT_NEAR(below / double{sets}, 0.05, 0.012);
}

TEST(MeanLevel, CountsTheWorstTrajectoryTwiceAndIsMinimal) {
    std::mt19937 random(1);
    std::normal_distribution<float> normal;
    TrajectoryScores scores(7);
    for (auto& trajectory : scores)
        for (const float shift = normal(random); trajectory.size() < 40;)
            trajectory.push_back(shift + normal(random));
    const auto mean = [&](float level) {
        double sum = 0, worst = 0;
        for (const auto& trajectory : scores) {
            sum += rate_above(trajectory, level);
            worst = std::max(worst, rate_above(trajectory, level));
        }
        return (sum + worst) / 8;
    };
    for (const double rate : {0.01, 0.05, 0.3}) {
        const float level = mean_level(scores, rate);
        EXPECT_LE(mean(level), rate + 1e-12);  // up to rounding
        EXPECT_GT(mean(std::nextafter(level, -10.f)), rate);
    }
}

TEST(ShareInterval, IsTheClopperPearsonInterval) {
    const Interval none = share_interval(0, 20), some = share_interval(3, 20), all = share_interval(20, 20);
    EXPECT_EQ(none.low, 0);
    EXPECT_NEAR(none.high, 1 - std::pow(0.025, 1.0 / 20), 1e-9);
    EXPECT_NEAR(some.low, 0.0320709, 1e-6);
    EXPECT_NEAR(some.high, 0.3789268, 1e-6);
    EXPECT_NEAR(all.low, std::pow(0.025, 1.0 / 20), 1e-9);
    EXPECT_EQ(all.high, 1);
}

TEST(MeanInterval, HasAboutTheStatedCoverage) {
    std::mt19937 random(2);
    std::normal_distribution<double> normal(3, 1);
    int held = 0;
    for (int i = 0; i < 200; ++i) {
        std::vector<double> draws(40);
        for (double& draw : draws) draw = normal(random);
        const Interval interval = mean_interval(draws, i);
        held += interval.low <= 3 && 3 <= interval.high;
    }
    EXPECT_GE(held, 180);
    EXPECT_LE(held, 199);
}

/// Scores of a synthetic bound with correlated frames and nodes: each trajectory has its own heavy-tailed
/// severity and a slowly varying phase; each node has its own scale.
class MadeUpBound {
 public:
    explicit MadeUpBound(bool gated) : gated_(gated) {
        const auto s = shapes::torus(16, 12);
        tree_ = build_sphere_tree(s.X, s.F, {.depth = 4});
    }

    const SphereTree& tree() const { return tree_; }

    BoundScores scores(int trajectories, int poses, unsigned seed) const {
        std::mt19937 random(seed);
        std::normal_distribution<float> normal;
        const Eigen::Index nodes = tree_.nodes.size();
        BoundScores scores{
            {}, PoseRows(trajectories * poses, nodes), PoseRows(trajectories * poses, gated_ ? nodes : 0)};
        for (int t = 0; t < trajectories; ++t) {
            const float severity = std::exp(0.7f * normal(random));
            float phase = normal(random);
            for (int p = 0; p < poses; ++p) {
                phase = 0.95f * phase + 0.3f * normal(random);
                const Eigen::Index row = scores.trajectories.size();
                scores.trajectories.push_back(t);
                for (Eigen::Index i = 0; i < nodes; ++i) {
                    const float ood_score = severity * std::abs(phase + 0.2f * normal(random));
                    const float scale = 0.01f * static_cast<float>(1 + i % 5);
                    scores.excess(row, i) = scale * (0.3f + ood_score) * normal(random);
                    if (gated_) scores.ood_score(row, i) = ood_score;
                }
            }
        }
        return scores;
    }

 private:
    bool gated_;
    SphereTree tree_;
};

/// Over 400 random splits into calibration and test, the stated miss rate holds as often as the theory
/// predicts. The rule of the mean can only raise levels, so this test of equality leaves it out.
TEST(Calibration, KeepsTheStatedMissRateAsOftenAsTheoryPredicts) {
    constexpr int repetitions = 400, calibration_count = 19, test_count = 5, poses = 25;
    for (const double confidence : {0.5, 0.9}) {
        const MadeUpBound bound(false);
        int kept = 0;
        for (int repetition = 0; repetition < repetitions; ++repetition) {
            // Trajectories are independent, so fresh draws act as random splits of an infinite pool.
            const BoundScores pool = bound.scores(calibration_count + test_count, poses, repetition);
            TrajectoryScores trajectories(calibration_count + test_count);
            for (Eigen::Index p = 0; p < pool.excess.rows(); ++p) {
                auto& trajectory = trajectories[pool.trajectories[p]];
                trajectory.insert(trajectory.end(), pool.excess.row(p).begin(), pool.excess.row(p).end());
            }
            const TrajectoryScores known(trajectories.begin(), trajectories.begin() + calibration_count);
            const float level = confident_level(known, 0.01, confidence);
            for (int t = calibration_count; t < calibration_count + test_count; ++t)
                kept += rate_above(trajectories[t], level) <= 0.01;
        }
        // The expectation is exactly ceil(20 c) / 20, since levels have no ties. The tests of one split share
        // its calibration, which has Beta(k, 20 - k) distributed coverage.
        const double share = static_cast<double>(kept) / (repetitions * test_count);
        const double between = confidence * (1 - confidence) / 21,
                     within = confidence * (1 - confidence) / test_count;
        EXPECT_NEAR(share, confidence, 4 * std::sqrt((between + within) / repetitions)) << confidence;
    }
}

/// Where a node misses: it is in range, and needs more than its margin at this score. [poses, nodes].
Eigen::ArrayXX<bool> misses(const Calibration& calibration, const BoundScores& scores) {
    Eigen::ArrayXX<bool> missed(scores.excess.rows(), scores.excess.cols());
    const bool gated = !calibration.limits.empty();
    for (Eigen::Index p = 0; p < missed.rows(); ++p)
        for (Eigen::Index i = 0; i < missed.cols(); ++i) {
            const float score = gated ? scores.ood_score(p, i) : 0, limit = gated ? calibration.limits[i] : 0;
            missed(p, i) = (!gated || (limit > 0 && score <= limit)) &&
                           scores.excess(p, i) / margin_weight(score, limit) > calibration.margins[i];
        }
    return missed;
}

/// By trajectory, the share of its poses and nodes of a depth that miss.
std::map<int, double> miss_rates(const BoundLevels& levels, const Calibration& calibration,
                                 const BoundScores& scores, int depth) {
    const int begin = levels.begins[depth], count = levels.begins[depth + 1] - begin;
    const Eigen::ArrayXd shares =
        misses(calibration, scores).middleCols(begin, count).cast<double>().rowwise().mean();
    std::map<int, double> rates;
    for (std::size_t p = 0; p < scores.trajectories.size(); ++p) {
        const int id = scores.trajectories[p];
        rates[id] += shares[p] / static_cast<double>(std::ranges::count(scores.trajectories, id));
    }
    return rates;
}

/// The scores of the given trajectories only.
BoundScores only(const BoundScores& scores, std::span<const int> trajectories) {
    std::vector<Eigen::Index> rows;
    BoundScores some;
    for (std::size_t i = 0; i < scores.trajectories.size(); ++i)
        if (std::ranges::find(trajectories, scores.trajectories[i]) != trajectories.end()) {
            rows.push_back(i);
            some.trajectories.push_back(scores.trajectories[i]);
        }
    some.excess = scores.excess(rows, Eigen::all);
    some.ood_score = scores.ood_score(rows, Eigen::all);
    return some;
}

TEST(Calibration, KeepsTheStatedMissRateAtEveryDepthOverRandomSplits) {
    constexpr int splits = 200, half = 30;
    std::vector<int> ids(2 * half);
    std::iota(ids.begin(), ids.end(), 0);
    for (const bool gated : {false, true}) {
        const MadeUpBound bound(gated);
        const BoundScores shape = bound.scores(30, 20, 1), pool = bound.scores(2 * half, 20, 2);
        Eigen::ArrayXd keeping = Eigen::ArrayXd::Zero(5), missing = keeping;
        for (int s = 0; s < splits; ++s) {
            const DatasetSplit split = draw_held_out(ids, 0.5, 1 + s);
            ASSERT_EQ(split.train.size(), half);
            const Calibration calibration = calibrate(bound.tree(), shape, only(pool, split.train),
                                                      {.miss_rate = 0.02, .confidence = 0.8});
            const BoundScores test = only(pool, split.held_out);
            for (int depth = 0; depth < 5; ++depth)
                for (const auto& [id, rate] : miss_rates(bound.tree(), calibration, test, depth)) {
                    keeping[depth] += (rate <= 0.02 + 1e-12) / double{splits * half};
                    missing[depth] += rate / (splits * half);
                }
        }
        // All splits share one pool with an exact mean over all splits of 25 / 31.
        EXPECT_GE(keeping.minCoeff(), 0.8 - 0.02) << gated;
        // The expectation is at most 0.02 + 1 / 31.
        EXPECT_LE(missing.maxCoeff(), 0.02 + 1.0 / 31) << gated;
        EXPECT_GT(missing.sum(), 0.001) << gated;  // vacuous margins would never miss
    }
}

TEST(Calibration, RejectsAConfidenceThatNeedsMoreTrajectories) {
    const MadeUpBound bound(false);
    const BoundScores few = bound.scores(4, 10, 3);
    EXPECT_EQ(error_of([&] { calibrate(bound.tree(), few, few, {.confidence = 0.9}); }),
              "4 trajectories cannot support a confidence of 0.9; allowed: up to 0.8");
    EXPECT_EQ(calibrate(bound.tree(), few, few, {}).confidence, 0.8);
    EXPECT_EQ(calibrate(bound.tree(), few, bound.scores(12, 10, 3), {}).confidence, 0.9);
}

TEST(Calibration, TakesEachNodesScaleAndLimitFromTheShapeScores) {
    const MadeUpBound bound(true);
    const BoundScores shape = bound.scores(30, 20, 4), scores = bound.scores(30, 20, 5);
    const Calibration calibration =
        calibrate(bound.tree(), shape, scores, {.miss_rate = 0.02, .confidence = 0.8, .out_of_range = 0.05});
    EXPECT_EQ(calibration.trajectories, 30);
    EXPECT_EQ(calibration.poses, 600);
    for (std::size_t i = 0; i < calibration.limits.size(); ++i) {
        const auto ood_score = shape.ood_score.col(i).array();
        EXPECT_EQ((ood_score > calibration.limits[i]).count(), 30);  // of 600
        EXPECT_EQ((ood_score >= calibration.limits[i]).count(), 31);
    }
    // Nodes 15 to 30 are the leaves; scale 5 needs larger margins than scale 1.
    EXPECT_GT(calibration.margins[19], 1.5f * calibration.margins[15]);
    check_calibration(calibration, "test", bound.tree().nodes.size());
}

TEST(Calibration, KeepsTheShapesMarginsWhereCalibrationPosesAreMild) {
    const MadeUpBound bound(true);
    const BoundScores shape = bound.scores(30, 20, 4);
    BoundScores mild = bound.scores(30, 20, 5);
    mild.excess.array() -= 1;
    const Calibration calibration = calibrate(bound.tree(), shape, mild, {.miss_rate = 0.02});
    // A tenth of the rate allows one miss in 600 poses.
    const Eigen::ArrayXXi missed = misses(calibration, shape).cast<int>();
    EXPECT_LE(missed.colwise().sum().maxCoeff(), 1);
    EXPECT_EQ(missed.sum(), missed.cols());
}

TEST(Calibration, RaisesTheMarginsOfADepthByWhatItsCalibrationPosesNeed) {
    const MadeUpBound bound(false);
    BoundScores shape = bound.scores(30, 20, 4), scores = bound.scores(30, 20, 5);
    shape.excess.setConstant(-1);
    scores.excess.setConstant(0.3f);
    for (const float margin : calibrate(bound.tree(), shape, scores, {.miss_rate = 0.02}).margins)
        EXPECT_NEAR(margin, 0.3f, 1e-5f);
}

TEST(Calibration, AsksLessOfPosesThatScoreLow) {
    const MadeUpBound bound(true);
    BoundScores scores = bound.scores(30, 20, 4);
    constexpr float limit = 569 / 600.f;  // exceeded by 30 of 600 poses
    for (Eigen::Index p = 0; p < scores.excess.rows(); ++p) {
        scores.ood_score.row(p).setConstant(static_cast<float>(p) / 600);
        scores.excess.row(p).setConstant(
            p % 2 == 0 && p < 300 ? 0.2f * margin_weight(static_cast<float>(p) / 600, limit) : -1.f);
    }
    const Calibration calibration =
        calibrate(bound.tree(), scores, scores, {.miss_rate = 0.02, .out_of_range = 0.05});
    EXPECT_NEAR(calibration.limits[0], limit, 1e-6f);
    for (const float margin : calibration.margins) EXPECT_NEAR(margin, 0.2f, 1e-4f);
}

TEST(SphereExcess, IsThatOfTheFarthestVertex) {
    Vertices x(5, 3);
    x << 1, 0, 0, 0, 1, 0, 9, 9, 9, 0, 0, 1, 0, -1.5f, 0;
    const std::vector<int> four{0, 1, 3, 4};
    EXPECT_FLOAT_EQ(sphere_excess(x, four, {{0, 0, 0}, 1}), 0.5f);
    EXPECT_FLOAT_EQ(sphere_excess(x, four, {{0, 0, 0}, 2}), -0.25f);
    EXPECT_EQ(sphere_excess(x, std::vector<int>{2}, {{9, 9, 9}, 0}), -1);
}

TEST(Calibration, GivesNoMarginToNodesThatAreAlwaysExact) {
    const MadeUpBound bound(true);
    BoundScores shape = bound.scores(20, 20, 6), scores = bound.scores(20, 20, 7);
    for (BoundScores* s : {&shape, &scores}) {
        s->ood_score.col(20).setZero();
        s->excess.col(20).setConstant(-1e-8f);
    }
    const Calibration calibration = calibrate(bound.tree(), shape, scores, {.miss_rate = 0.02});
    EXPECT_EQ(calibration.margins[20], 0);
    EXPECT_EQ(calibration.limits[20], 0);
    EXPECT_GT(calibration.margins[21], 0);
}

TEST(Calibration, CountsOutOfDistributionPosesAsBoundedExactly) {
    const MadeUpBound bound(true);
    const BoundScores shape = bound.scores(20, 20, 8);
    const Calibration calibration =
        calibrate(bound.tree(), shape, bound.scores(20, 20, 9), {.miss_rate = 0.02});
    BoundScores far = bound.scores(1, 3, 10);
    far.excess.setConstant(10);
    EXPECT_TRUE(misses(calibration, far).all());
    far.ood_score.row(1).setConstant(1e6f);
    far.ood_score.row(2).setConstant(NAN);
    const auto missed = misses(calibration, far);
    EXPECT_TRUE(missed.row(0).all());
    EXPECT_FALSE(missed.row(1).any());
    EXPECT_FALSE(missed.row(2).any());
    EXPECT_NEAR(miss_rates(bound.tree(), calibration, far, 3).at(0), 1.0 / 3, 1e-9);
}

TEST(Calibration, RejectsBoundsOfRadiusZero) {
    const MadeUpBound bound(false);
    const BoundScores shape = bound.scores(20, 20, 11);
    BoundScores scores = bound.scores(20, 20, 12);
    scores.excess.col(7).setConstant(INFINITY);
    EXPECT_EQ(error_of([&] { calibrate(bound.tree(), shape, scores, {}); }),
              "cannot calibrate depth 3: its bounds have radius 0 in too many poses");
    EXPECT_EQ(error_of([&] { calibrate(bound.tree(), scores, shape, {}); }),
              "cannot calibrate node 7: its bound has radius 0 in too many poses");
}

}  // namespace
}  // namespace nbd
