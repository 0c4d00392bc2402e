#include "meshing/tets/order_by_place.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <vector>

#include "tests/support/box_mesh.hpp"

namespace nbd {
namespace {

/// The corners of each tetrahedron, by their positions.
std::vector<std::array<double, 12>> corners(const TetMesh& tets) {
    std::vector<std::array<double, 12>> all;
    for (Eigen::Index t = 0; t < tets.T.rows(); ++t) {
        std::array<double, 12> at;
        for (int a = 0; a < 4; ++a)
            for (int i = 0; i < 3; ++i) at[3 * a + i] = tets.X(tets.T(t, a), i);
        all.push_back(at);
    }
    std::ranges::sort(all);
    return all;
}

/// Mean distance in memory of the nodes of a tetrahedron.
double mean_reach(const TetMesh& tets) {
    double sum = 0;
    for (Eigen::Index t = 0; t < tets.T.rows(); ++t)
        sum += tets.T.row(t).maxCoeff() - tets.T.row(t).minCoeff();
    return sum / static_cast<double>(tets.T.rows());
}

/// A box whose nodes and tetrahedra are numbered irregularly.
TetMesh shuffled_box() {
    TetMesh box = test::box_mesh({1, 1, 1}, {12, 12, 12}), result = box;
    const Eigen::Index nodes = box.X.rows(), tets = box.T.rows();
    for (Eigen::Index i = 0; i < nodes; ++i) result.X.row(i * 1009 % nodes) = box.X.row(i);
    for (Eigen::Index t = 0; t < tets; ++t)
        for (int a = 0; a < 4; ++a) result.T(t * 1013 % tets, a) = box.T(t, a) * 1009 % nodes;
    return result;
}

TEST(OrderByPlace, KeepsTheMeshAndBringsNeighboursTogether) {
    const TetMesh box = shuffled_box();
    TetMesh ordered = box;
    order_by_place(ordered);
    EXPECT_EQ(corners(ordered), corners(box));
    EXPECT_LT(mean_reach(ordered), 0.5 * mean_reach(box));
    for (Eigen::Index t = 1; t < ordered.T.rows(); ++t)
        EXPECT_LE(ordered.T.row(t - 1).minCoeff(), ordered.T.row(t).minCoeff());
}

TEST(OrderByPlace, KeepsAMeshThatIsInOrder) {
    TetMesh once = shuffled_box();
    order_by_place(once);
    TetMesh twice = once;
    order_by_place(twice);
    EXPECT_EQ(twice.X, once.X);
    EXPECT_EQ(twice.T, once.T);
}

}  // namespace
}  // namespace nbd
