#include "meshing/remesh/remesh.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "meshing/surface/solid_boundary.hpp"
#include "tests/meshing/shapes.hpp"
#include "tests/support/error_of.hpp"

namespace nbd {
namespace {

double mean_edge(const TriMesh& mesh) {
    double sum = 0;
    for (const auto& f : mesh.F.rowwise())
        for (int k = 0; k < 3; ++k) sum += (mesh.X.row(f[k]) - mesh.X.row(f[(k + 1) % 3])).norm();
    return sum / static_cast<double>(3 * mesh.F.rows());
}

/// From CAD's twelve triangles, at any size.
TEST(Remesh, KeepsTheCornersAndTheVolumeOfABox) {
    for (const double size : {1e-3, 1.0, 1e3}) {
        const TriMesh box = test::box(size, 0.1 * size, 0.1 * size, 1);
        for (const double edge : {0.1, 0.05, 0.02}) {
            const TriMesh fine = make_solid_boundary(remesh(box, edge * size)).mesh;
            EXPECT_NEAR(enclosed_volume(fine), enclosed_volume(box), 1e-6 * enclosed_volume(box));
            EXPECT_NEAR(mean_edge(fine), edge * size, 0.3 * edge * size);
            for (const auto& corner : box.X.rowwise())
                EXPECT_LT((fine.X.rowwise() - corner).rowwise().norm().minCoeff(), 1e-6 * size);
        }
    }
}

TEST(Remesh, KeepsTheVolumeOfABallOnFewTriangles) {
    const TriMesh ball = test::icosphere(4);
    const TriMesh coarse = make_solid_boundary(remesh(ball, 0.6)).mesh;
    EXPECT_LT(coarse.F.rows(), ball.F.rows() / 20);
    EXPECT_NEAR(enclosed_volume(coarse), enclosed_volume(ball), 1e-6 * enclosed_volume(ball));
    EXPECT_NEAR(enclosed_volume(ball), 4 * std::numbers::pi / 3, 0.02);
}

TEST(Remesh, GivesTheSameBits) {
    const TriMesh torus = test::torus(1, 0.3, 40, 16), a = remesh(torus, 0.2), b = remesh(torus, 0.2);
    EXPECT_EQ(a.X, b.X);
    EXPECT_EQ(a.F, b.F);
    EXPECT_NEAR(static_cast<double>(a.F.rows()), remeshed_faces(torus, 0.2),
                0.3 * remeshed_faces(torus, 0.2));
}

TEST(Remesh, RefusesEdgesThatAreNone) {
    const TriMesh ball = test::icosphere(2);
    EXPECT_EQ(test::error_of([&] { remesh(ball, 0); }), "an edge of 0 m; allowed: more than 0");
    EXPECT_EQ(test::error_of([&] { remesh(ball, std::nan("")); }), "an edge of nan m; allowed: more than 0");
    EXPECT_EQ(test::error_of([&] { remesh(ball, 50); }),
              "triangles with edges of 50 m do not follow the surface");
}

}  // namespace
}  // namespace nbd
