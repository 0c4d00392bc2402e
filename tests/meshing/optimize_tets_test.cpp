#include "meshing/tets/optimize_tets.hpp"

#include <gtest/gtest.h>

#include <random>
#include <set>
#include <vector>

#include "meshing/tets/tet_quality.hpp"
#include "meshing/tets/tetrahedralize.hpp"
#include "tests/meshing/shapes.hpp"

namespace nbd {
namespace {

int count_poor(const TetMesh& tets) { return tet_quality(tets).poor; }

void expect_keeps_boundary(const TetMesh& before, const TetMesh& after) {
    const Faces boundary = boundary_faces(before);
    EXPECT_EQ(test::sorted_faces(boundary_faces(after)), test::sorted_faces(boundary));
    for (const int node : boundary.reshaped()) EXPECT_EQ(after.X.row(node), before.X.row(node));
    EXPECT_NEAR(tet_quality(after).volume, tet_quality(before).volume, 1e-12);
    EXPECT_GT(tet_quality(after).volume_min, 0);
    std::set<int> used(after.T.data(), after.T.data() + after.T.size());
    EXPECT_EQ(static_cast<Eigen::Index>(used.size()), after.X.rows()) << "nodes without a tetrahedron";
}

/// A filled cube whose inner nodes are pushed about until many tetrahedra are nearly flat.
TetMesh shaken_cube() {
    const TriMesh surface = test::box(1, 1, 1, 6);
    TetMesh tets = tetrahedralize(surface).tets;
    std::mt19937 random(7);
    std::uniform_real_distribution<double> by(-0.2, 0.2);
    for (Eigen::Index v = surface.X.rows(); v < tets.X.rows(); ++v)
        for (int attempt = 0; attempt < 20; ++attempt) {
            const Eigen::RowVector3d before = tets.X.row(v);
            tets.X.row(v) += Eigen::RowVector3d(by(random), by(random), by(random));
            if (tet_quality(tets).radius_ratio_min > 1e-4) continue;
            tets.X.row(v) = before;
        }
    return tets;
}

/// Two nearly coplanar boundary faces of one tetrahedron, on top of two more tetrahedra.
TetMesh flat_top(double depth) {
    TetMesh tets;
    tets.X.resize(5, 3);
    tets.X << -1, 0, 0, 1, 0, 0, 0, -1, -depth, 0, 1, -depth, 0, 0, -1;
    tets.T.resize(3, 4);
    tets.T << 0, 1, 2, 3, 0, 2, 4, 3, 1, 2, 3, 4;
    return tets;
}

TEST(OptimizeTets, RepairsPoorTetrahedraWithoutNewNodes) {
    const TetMesh before = shaken_cube();
    ASSERT_GT(count_poor(before), 30);
    TetMesh after = before;
    const TetOptimization done = optimize_tets(after, 0);
    EXPECT_EQ(done.poor_before, count_poor(before));
    EXPECT_EQ(done.poor_after, 0);
    EXPECT_EQ(count_poor(after), 0);
    EXPECT_EQ(done.nodes_added, 0);
    EXPECT_EQ(after.X.rows(), before.X.rows());
    expect_keeps_boundary(before, after);
}

TEST(OptimizeTets, GivesTheSameBitsAgain) {
    TetMesh first = shaken_cube(), second = first;
    optimize_tets(first, 10);
    optimize_tets(second, 10);
    EXPECT_EQ(first.X, second.X);
    EXPECT_EQ(first.T, second.T);
}

TEST(OptimizeTets, RemovesAnEdgeBelowTwoFlatFaces) {
    const TetMesh before = flat_top(0.02);
    ASSERT_GT(tet_quality(before).volume_min, 0);
    ASSERT_EQ(count_poor(before), 1);
    TetMesh after = before;
    EXPECT_EQ(optimize_tets(after, 0).poor_after, 0);
    EXPECT_EQ(after.T.rows(), 2);
    expect_keeps_boundary(before, after);
}

TEST(OptimizeTets, LeavesOtherMeshesAsTheyAre) {
    const TetMesh before = tetrahedralize(test::box(1, 1, 1, 4)).tets;
    ASSERT_EQ(count_poor(before), 0);
    TetMesh after = before;
    EXPECT_EQ(optimize_tets(after, 100).poor_before, 0);
    EXPECT_EQ(after.X, before.X);
    EXPECT_EQ(after.T, before.T);
}

TEST(OptimizeTets, CountsWhatTheBoundaryForcesToBePoor) {
    TetMesh tets;  // one flat tetrahedron, all of it boundary
    tets.X.resize(4, 3);
    tets.X << 0, 0, 0, 1, 0, 0, 0, 1, 0, 0.3, 0.3, 0.01;
    tets.T.resize(1, 4);
    tets.T << 0, 1, 2, 3;
    const TetMesh before = tets;
    const TetOptimization done = optimize_tets(tets, 100);
    EXPECT_EQ(done.poor_before, 1);
    EXPECT_EQ(done.poor_after, 1);
    EXPECT_EQ(tets.X, before.X);
    EXPECT_EQ(tets.T, before.T);
    EXPECT_EQ(describe(done), "optimised 0 of 1 tetrahedra below a radius ratio of 0.1; added 0 nodes");
}

}  // namespace
}  // namespace nbd
