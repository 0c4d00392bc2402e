#include "meshing/tets/tet_quality.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <set>
#include <vector>

#include "meshing/tets/optimize_tets.hpp"
#include "meshing/tets/order_by_place.hpp"
#include "meshing/tets/tetrahedralize.hpp"
#include "tests/meshing/shapes.hpp"
#include "tests/support/box_mesh.hpp"

namespace nbd {
namespace {

TetMesh one_tet(std::initializer_list<double> xyz) {
    TetMesh tets;
    tets.X = Eigen::Map<const Nodes>(xyz.begin(), 4, 3);
    tets.T.resize(1, 4);
    tets.T << 0, 1, 2, 3;
    return tets;
}

TEST(TetQuality, IsOneForARegularTetrahedron) {
    const TetQuality q = tet_quality(one_tet({1, 1, 1, -1, 1, -1, 1, -1, -1, -1, -1, 1}));
    EXPECT_NEAR(q.radius_ratio_min, 1, 1e-14);
    EXPECT_NEAR(q.dihedral_min, std::acos(1. / 3) * 180 / M_PI, 1e-12);
    EXPECT_NEAR(q.dihedral_max, q.dihedral_min, 1e-12);
    EXPECT_NEAR(q.volume, 8. / 3, 1e-14);
    EXPECT_EQ(q.radius_ratio_histogram[9], 1);
}

TEST(TetQuality, MatchesTheClosedFormForTheCornerOfACube) {
    const TetQuality q = tet_quality(one_tet({0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1}));
    const double r = 1 / (3 + std::sqrt(3.)), R = std::sqrt(3.) / 2;
    EXPECT_NEAR(q.radius_ratio_mean, 3 * r / R, 1e-14);
    EXPECT_NEAR(q.dihedral_max, 90, 1e-12);
    EXPECT_NEAR(q.dihedral_min, std::acos(1 / std::sqrt(3.)) * 180 / M_PI, 1e-12);
    EXPECT_NEAR(q.volume_min, 1. / 6, 1e-15);
}

TEST(TetQuality, DistinguishesFlatAndInvertedTetrahedra) {
    EXPECT_EQ(tet_quality(one_tet({0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0})).radius_ratio_min, 0);
    const TetQuality q = tet_quality(one_tet({0, 0, 0, 0, 1, 0, 1, 0, 0, 0, 0, 1}));
    EXPECT_LT(q.radius_ratio_min, 0);
    EXPECT_LT(q.volume_min, 0);
    EXPECT_EQ(q.worst_tet, 0);
}

TEST(TetQuality, DoesNotDependOnSize) {
    const auto at = [](double h) {
        return tet_quality(one_tet({0, 0, 0, h, 0, 0, 0, 2 * h, 0, 0, 0, 3 * h}));
    };
    EXPECT_NEAR(at(1e-6).radius_ratio_min, at(1e6).radius_ratio_min, 1e-12);
    EXPECT_NEAR(at(1e-6).dihedral_min, at(1e6).dihedral_min, 1e-9);
}

TEST(TetQuality, IsPrintedAsATable) {
    const std::string text = to_text(tet_quality(one_tet({0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1})));
    EXPECT_NE(text.find("tetrahedra              1\n"), std::string::npos) << text;
    EXPECT_NE(text.find("dihedral angles         54.7 .. 90.0 degrees\n"), std::string::npos) << text;
}

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
