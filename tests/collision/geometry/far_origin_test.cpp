#include "collision/geometry/far_origin.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace nbd {
namespace {

Eigen::AlignedBox3d cube_at(double x, double y, double z, double half = 0.5) {
    const Eigen::Vector3d c(x, y, z);
    return {c.array() - half, c.array() + half};
}

TEST(FarOrigin, IsZeroNearZero) {
    EXPECT_EQ(far_origin(cube_at(0, 0, 0), 0.1), Eigen::Vector3d::Zero());
    EXPECT_EQ(far_origin(cube_at(5, -20, 3), 0.1), Eigen::Vector3d::Zero());
    EXPECT_EQ(far_origin(Eigen::AlignedBox3d(), 0.1), Eigen::Vector3d::Zero());
}

TEST(FarOrigin, LiesNearWhatIsFar) {
    for (const double far : {1e3, 5.4e6, 1e12}) {
        const Eigen::Vector3d origin = far_origin(cube_at(far + 0.3, -far, 7), 0.1);
        EXPECT_LE((origin - Eigen::Vector3d(far + 0.3, -far, 7)).cwiseAbs().maxCoeff(),
                  std::max(1.0, 1e-6 * far));
        EXPECT_NE(origin, Eigen::Vector3d::Zero());
    }
}

TEST(FarOrigin, SubtractsAndAddsWithoutRounding) {
    const Eigen::Vector3d origin = far_origin(cube_at(500'000.3, 5'400'000.7, 300.1), 0.1);
    for (const double x : {499'999.8, 500'000.123456789, 500'000.8})
        EXPECT_EQ((x - origin.x()) + origin.x(), x);
}

TEST(FarOrigin, DependsOnTheEdgesNotOnTheBox) {
    EXPECT_EQ(far_origin(cube_at(50, 0, 0), 1), Eigen::Vector3d::Zero());
    EXPECT_NE(far_origin(cube_at(50, 0, 0), 1e-3), Eigen::Vector3d::Zero());
}

TEST(FarOrigin, KnowsTheStepsOfFloat) {
    EXPECT_EQ(float_step(1), std::ldexp(1., -23));
    EXPECT_EQ(float_step(-1.5), std::ldexp(1., -23));
    EXPECT_EQ(float_step(5.4e6), 0.5);
}

TEST(FarOrigin, LeavesOutFacesWithoutVertices) {
    const Nodes X = (Nodes(3, 3) << 0, 0, 0, 3, 0, 0, 0, 4, 0).finished();
    const Faces F = (Faces(2, 3) << 0, 1, 2, 0, 1, 7).finished();
    EXPECT_DOUBLE_EQ(mean_edge(X, F), 4);
    EXPECT_EQ(mean_edge(X, F.bottomRows(1)), 0);
}

}  // namespace
}  // namespace nbd
