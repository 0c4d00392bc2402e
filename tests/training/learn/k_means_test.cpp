#include "training/learn/k_means.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <set>
#include <stdexcept>

#include "collision/base/counter_random.hpp"
#include "tests/support/file_damage.hpp"
#include "tests/support/on_threads.hpp"
#include "tests/training/bar.hpp"
#include "training/learn/cluster_modes.hpp"

namespace nbd {
namespace {

using test::Bar;

/// `groups` clusters of `each` points around well-separated centres.
PointRows clouds(int groups, int each, int dimensions) {
    PointRows points(groups * each, dimensions);
    for (int i = 0; i < points.rows(); ++i)
        for (int d = 0; d < dimensions; ++d)
            points(i, d) =
                static_cast<float>(100 * counter_uniform(1, i % groups, d) + counter_uniform(2, i, d));
    return points;
}

double inertia_of(const PointRows& points, const Clustering& c) {
    PointRows mean = PointRows::Zero(c.sizes.size(), points.cols());
    for (int i = 0; i < points.rows(); ++i) mean.row(c.label[i]) += points.row(i);
    for (int k = 0; k < mean.rows(); ++k) mean.row(k) /= c.sizes[k];
    double sum = 0;
    for (int i = 0; i < points.rows(); ++i) sum += (points.row(i) - mean.row(c.label[i])).squaredNorm();
    return sum;
}

TEST(KMeans, FindsSeparateClusters) {
    const int groups = 9, each = 70;
    const PointRows points = clouds(groups, each, 12);
    const Clustering c = k_means(points, {.clusters = groups}, 0);
    ASSERT_EQ(c.sizes.size(), groups);
    EXPECT_TRUE((c.sizes.array() == each).all());
    std::set<int> seen;
    for (int i = 0; i < points.rows(); ++i) {
        EXPECT_EQ(c.label[i], c.label[i % groups]);
        seen.insert(c.label[i]);
    }
    EXPECT_EQ(seen.size(), 9u);
    EXPECT_NEAR(c.inertia, inertia_of(points, c), 1e-3 * c.inertia);
}

TEST(KMeans, FindsClustersFromAPartOfThePoints) {
    const int groups = 40, each = 700;
    PointRows points = clouds(groups, each, 5);
    const Clustering part = k_means(points, {.clusters = groups, .points_per_cluster = 20}, 1);
    ASSERT_EQ(part.label.size(), static_cast<std::size_t>(groups * each));
    EXPECT_EQ(part.sizes.sum(), groups * each);
    EXPECT_GE(part.inertia, inertia_of(points, part));
    const Clustering whole = k_means(points, {.clusters = groups, .points_per_cluster = groups * each}, 1);
    EXPECT_GT(part.inertia, whole.inertia);
    EXPECT_LT(part.inertia,
              1.1 * whole.inertia);  // the mean of 20 points is off by a twentieth of a variance
}

TEST(KMeans, PicksTheMemberNearestToTheMeanAsRepresentative) {
    const PointRows points = clouds(5, 40, 6);
    const Clustering c = k_means(points, {.clusters = 5}, 3);
    for (int k = 0; k < 5; ++k) {
        Eigen::RowVectorXf mean = Eigen::RowVectorXf::Zero(6);
        for (int i = 0; i < points.rows(); ++i)
            if (c.label[i] == k) mean += points.row(i) / c.sizes[k];
        const int r = c.representatives[k];
        EXPECT_EQ(c.label[r], k);
        for (int i = 0; i < points.rows(); ++i) {
            if (c.label[i] != k) continue;
            EXPECT_LE((points.row(r) - mean).norm(), (points.row(i) - mean).norm() + 1e-4f);
        }
    }
}

TEST(KMeans, GivesTheSameBitsOnAnyNumberOfThreads) {
    const PointRows points = clouds(40, 50, 7);
    const auto run = [&] { return k_means(points, {.clusters = 33}, 5); };
    const Clustering one = test::on_threads(1, run), two = test::on_threads(2, run);
    EXPECT_EQ(one.label, two.label);
    EXPECT_EQ(one.representatives, two.representatives);
    EXPECT_EQ(one.inertia, two.inertia);
    EXPECT_NE(one.representatives, k_means(points, {.clusters = 33}, 6).representatives);
}

TEST(KMeans, UsesEveryPointWhenThereAreFewerPointsThanClusters) {
    const PointRows points = clouds(3, 4, 2);
    const Clustering c = k_means(points, {.clusters = 50}, 0);
    std::vector<int> representatives = c.representatives;
    std::ranges::sort(representatives);
    std::vector<int> all(12);
    for (int i = 0; i < 12; ++i) all[i] = i;
    EXPECT_EQ(representatives, all);
    EXPECT_EQ(c.inertia, 0);
}

TEST(KMeans, DropsClustersLeftEmptyByCoincidingPoints) {
    PointRows points(30, 2);
    for (int i = 0; i < 30; ++i) points.row(i).setConstant(static_cast<float>(i % 3));
    const Clustering c = k_means(points, {.clusters = 10}, 0);
    ASSERT_EQ(c.representatives.size(), 3u);
    EXPECT_TRUE((c.sizes.array() == 10).all());
    EXPECT_LT(*std::ranges::max_element(c.label), 3);
}

TEST(KMeans, RejectsAnEmptySetAndAnInvalidConfig) {
    EXPECT_THROW(k_means(PointRows(0, 3), {}, 0), std::invalid_argument);
    EXPECT_THROW(k_means(PointRows::Zero(2, 3), {.clusters = 0}, 0), std::invalid_argument);
    EXPECT_THROW(k_means(PointRows::Zero(2, 3), {.max_iterations = 0}, 0), std::invalid_argument);
    EXPECT_THROW(k_means(PointRows::Zero(2, 3), {.points_per_cluster = 0}, 0), std::invalid_argument);
}

class ClusterModes : public test::FileTest {
 protected:
    void SetUp() override {
        FileTest::SetUp();
        bar.record(folder / "data.h5", 3, 40, 9);
    }
    ClusteredModesChoice choose(int clusters, int initialisations) {
        const RecordingReader data(folder / "data.h5");
        FrameSource source(bar.body.W, data);
        return cluster_modes(
            bar.body, source, complete_frames(data),
            {.k_means = {.clusters = clusters}, .initialisations = initialisations, .poses = 60});
    }
    Bar bar{12, 3};
};

TEST_F(ClusterModes, GiveExactModalCoordinatesWithEveryVertex) {
    const auto choice = choose(100000, 1);
    EXPECT_EQ(choice.modes.X.rows(), bar.body.X.rows());
    EXPECT_LT(choice.z_error, 1e-4);
}

TEST_F(ClusterModes, CountEveryVertexOnceAndKeepTheRowsOfU) {
    const ClusteredModes modes = choose(30, 2).modes;
    ASSERT_EQ(modes.representatives.size(), 30u);
    EXPECT_EQ(modes.w.sum(), static_cast<float>(bar.body.X.rows()));
    for (int i = 0; i < 30; ++i) {
        const int v = modes.representatives[i];
        EXPECT_EQ(modes.X.row(i), bar.body.X.row(v));
        const Eigen::MatrixXf rows = bar.body.U.middleRows(3 * v, 3);
        EXPECT_TRUE(modes.U.numbers().middleRows(3 * i, 3).isApprox(rows, 1e-3f));
    }
}

TEST_F(ClusterModes, GiveBetterCoordinatesWithMoreClusters) {
    const double few = choose(15, 1).z_error, many = choose(120, 1).z_error;
    EXPECT_GT(few, 0.005);
    EXPECT_LT(many, few);
}

TEST_F(ClusterModes, KeepTheBestOfSeveralInitialisationsOnAnyNumberOfThreads) {
    const auto one = test::on_threads(1, [&] { return choose(20, 6); });
    const auto two = test::on_threads(2, [&] { return choose(20, 6); });
    EXPECT_EQ(one.modes.representatives, two.modes.representatives);
    EXPECT_EQ(one.z_error, two.z_error);
    // The first is not the best of them here, and each more that is tried makes the choice no worse.
    double last = std::numeric_limits<double>::infinity(), first = choose(20, 1).z_error;
    for (int tried = 1; tried <= 6; ++tried) {
        const double error = choose(20, tried).z_error;
        EXPECT_LE(error, 1.02 * last) << tried;  // the choice is by absolute errors, this one is relative
        last = error;
    }
    EXPECT_LT(one.z_error, 0.99 * first);
}

TEST_F(ClusterModes, RejectAnInvalidConfig) {
    EXPECT_THROW(choose(0, 1), std::invalid_argument);
    EXPECT_THROW(choose(5, 0), std::invalid_argument);
}

}  // namespace
}  // namespace nbd
