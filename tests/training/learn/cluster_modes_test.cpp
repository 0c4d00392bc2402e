#include "training/learn/cluster_modes.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <stdexcept>

#include "tests/support/file_damage.hpp"
#include "tests/support/on_threads.hpp"
#include "tests/training/bar.hpp"

namespace nbd {
namespace {

using test::Bar;

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
