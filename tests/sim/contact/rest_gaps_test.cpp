#include "sim/contact/rest_gaps.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "meshing/body/make_body.hpp"
#include "tests/support/box_body.hpp"
#include "tests/support/box_mesh.hpp"

namespace nbd {
namespace {

/// A bar of 3 m with a slot from one end, 2 m deep, between walls 1/3 m apart, stretched along z.
TriMesh fork(double stretch) {
    const TetMesh bar = test::box_mesh({3, 1, 1}, {9, 3, 3});
    std::vector<int> kept;
    for (int t = 0; t < bar.T.rows(); ++t) {
        const Eigen::RowVector3d centroid = bar.X(bar.T.row(t), Eigen::all).colwise().mean();
        if (centroid[0] < 1 || centroid[2] < 1.0 / 3 || centroid[2] > 2.0 / 3) kept.push_back(t);
    }
    std::vector<int> number(bar.X.rows(), -1), used;
    Tets T = bar.T(kept, Eigen::all);
    for (int& node : T.reshaped()) {
        int& name = number[node];
        if (name < 0) {
            name = used.size();
            used.push_back(node);
        }
        node = name;
    }
    TriMesh mesh = make_body("fork", {bar.X(used, Eigen::all), T}).surface;
    mesh.X.col(2) *= stretch;
    return mesh;
}

TEST(RestGaps, AreFoundWhereWallsOfASlotAreNear) {
    const RestGaps wide = rest_gaps(fork(1), 0.35);
    EXPECT_GT(wide.pairs, 0);
    EXPECT_NEAR(wide.least, 1.0 / 3, 1e-6);
    EXPECT_EQ(rest_gaps(fork(1), 0.3).pairs, 0);
    const RestGaps narrow = rest_gaps(fork(0.01), 0.35);
    EXPECT_NEAR(narrow.least, 0.01 / 3, 1e-6);
    EXPECT_GE(narrow.pairs, wide.pairs);
}

/// At the bottom of the slot its walls are joined by an edge or two.
TEST(RestGaps, AreNotThoseNearAlongTheSurface) { EXPECT_EQ(rest_gaps(fork(1), 2.1).pairs, 0); }

TEST(RestGaps, AreNotBetweenTheSidesOfAThinPart) {
    const TriMesh plate = test::box_body({1, 1, 0.01}, {4, 4, 1}).surface;
    EXPECT_EQ(rest_gaps(plate, 0.05).pairs, 0);
}

TEST(RestGaps, DoNotDependOnThePlace) {
    TriMesh far = fork(0.01);
    far.X.rowwise() += Eigen::RowVector3d(5e5, 5e6, 0);
    const RestGaps here = rest_gaps(fork(0.01), 0.35), there = rest_gaps(far, 0.35);
    EXPECT_EQ(there.pairs, here.pairs);
    EXPECT_NEAR(there.least, here.least, 1e-6);
}

}  // namespace
}  // namespace nbd
