#include "training/networks/linear_centre.hpp"

#include <gtest/gtest.h>

#include "tests/support/on_threads.hpp"

namespace nbd {
namespace {

/// Spheres of two nodes in 60 poses. The centres are affine in three modal coordinates, the radii random.
struct Linear {
    PoseRows z = PoseRows::Random(60, 3), spheres = PoseRows::Random(60, 8);
    Eigen::MatrixXf map = Eigen::MatrixXf::Random(3, 6);

    Linear() {
        for (int node = 0; node < 2; ++node)
            spheres.middleCols<3>(4 * node) =
                (z * map.middleCols<3>(3 * node)).rowwise() + Eigen::RowVector3f(1, -2, 3);
    }
};

TEST(LinearCentre, FindsTheLinearMapAndLeavesTheOffsetAndTheRadii) {
    Linear data;
    const PoseRows before = data.spheres;
    const Eigen::MatrixXf map = take_linear_centre(data.z, data.spheres);
    EXPECT_LT((map - data.map).cwiseAbs().maxCoeff(), 2e-3f);
    for (int node = 0; node < 2; ++node) {
        const PoseRows left = data.spheres.middleCols<3>(4 * node).rowwise() - Eigen::RowVector3f(1, -2, 3);
        EXPECT_LT(left.cwiseAbs().maxCoeff(), 5e-3f);
        EXPECT_EQ(data.spheres.col(4 * node + 3), before.col(4 * node + 3));
    }
}

TEST(LinearCentre, IgnoresAConstantCoordinate) {
    Linear data;
    data.z.col(1).setZero();
    const Eigen::MatrixXf map = take_linear_centre(data.z, data.spheres);
    EXPECT_TRUE(map.allFinite());
    EXPECT_EQ(map.row(1).cwiseAbs().maxCoeff(), 0);
}

TEST(LinearCentre, GivesTheSameBitsOnAnyNumberOfThreads) {
    const Linear data;
    const auto run = [&] {
        PoseRows spheres = data.spheres;
        return take_linear_centre(data.z, spheres);
    };
    EXPECT_EQ(test::on_threads(1, run), test::on_threads(2, run));
}

}  // namespace
}  // namespace nbd
