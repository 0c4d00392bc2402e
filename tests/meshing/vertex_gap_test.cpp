#include "meshing/surface/mesh.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tests/meshing/shapes.hpp"

namespace nbd {
namespace {

/// The same by a fine grid of points.
double gap_of_samples(const TriMesh& face) {
    constexpr int n = 400;
    double largest = 0;
    for (int i = 0; i <= n; ++i)
        for (int j = 0; i + j <= n; ++j) {
            const Eigen::RowVector3d p =
                (i * face.X.row(0) + j * face.X.row(1) + (n - i - j) * face.X.row(2)) / n;
            largest = std::max(largest, (face.X.rowwise() - p).rowwise().norm().minCoeff());
        }
    return largest;
}

TEST(VertexGap, IsTheLargestDistanceOfAPointOfAFaceFromItsVertices) {
    std::mt19937 random(3);
    std::uniform_real_distribution<double> at(-1, 1);
    int obtuse = 0;
    for (int k = 0; k < 50; ++k) {
        TriMesh face{Nodes(3, 3), Faces(1, 3)};
        face.F << 0, 1, 2;
        for (double& x : face.X.reshaped()) x = at(random);
        const double gap = vertex_gap(face), found = gap_of_samples(face);
        double longest = 0;
        for (int i = 0; i < 3; ++i) {
            const Eigen::RowVector3d u = face.X.row((i + 1) % 3) - face.X.row(i),
                                     v = face.X.row((i + 2) % 3) - face.X.row(i);
            longest = std::max(longest, u.norm());
            obtuse += u.dot(v) < 0;
        }
        EXPECT_LE(found, gap * (1 + 1e-12));
        EXPECT_GE(found, gap - 0.01 * longest);
        EXPECT_LE(gap, longest / std::sqrt(3.0));
    }
    EXPECT_GT(obtuse, 10);
    EXPECT_LT(obtuse, 45);
}

TEST(VertexGap, IsThatOfTheCoarsestFace) {
    EXPECT_NEAR(vertex_gap(test::box(4, 1, 1, 1)), std::sqrt(17.0) / 2, 1e-12);
    EXPECT_NEAR(vertex_gap(test::box(4, 1, 1, 2)), std::sqrt(17.0) / 4, 1e-12);
    EXPECT_EQ(vertex_gap({}), 0);
}

}  // namespace
}  // namespace nbd
