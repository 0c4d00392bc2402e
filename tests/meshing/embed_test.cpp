#include "meshing/body/embed.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <string>

#include "meshing/body/enclose.hpp"
#include "meshing/surface/mesh.hpp"
#include "meshing/surface/quadratic_tets.hpp"
#include "meshing/surface/subdivide.hpp"
#include "tests/meshing/shapes.hpp"
#include "tests/support/box_mesh.hpp"
#include "tests/support/error_of.hpp"
#include "tests/support/temporary_folder.hpp"

namespace nbd {
namespace {

using namespace test;

/// Points spread evenly over a box by a fixed rule.
Nodes points_in(const Eigen::AlignedBox3d& box, int count) {
    Nodes points(count, 3);
    for (int p = 0; p < count; ++p)
        for (int k = 0; k < 3; ++k) {
            const double step[] = {0.8191725133961645, 0.6710436067037893, 0.5497004779019703};
            const double s = std::fmod(0.5 + (p + 1) * step[k], 1.);
            points(p, k) = box.min()[k] + s * box.sizes()[k];
        }
    return points;
}

Nodes affine(const Nodes& X) {
    Eigen::Matrix3d A;
    A << 1.1, 0.3, -0.2, 0.1, 0.9, 0.4, -0.3, 0.2, 1.3;
    return (X * A.transpose()).rowwise() + Eigen::RowVector3d(0.3, -0.2, 0.7);
}

double error_under_affine_motion(const Embedding& W, const Nodes& nodes, const Nodes& points) {
    return (W * affine(nodes) - affine(points)).cwiseAbs().maxCoeff();
}

TEST(Embed, ReproducesAffineMotionsWithWeightsFromZeroToOne) {
    const TetMesh tets = test::box_mesh({1, 2, 3}, {5, 5, 5});
    const Nodes points = points_in({Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(1, 2, 3)}, 3000);
    const Embedding W = embed(tets, points);
    ASSERT_EQ(W.rows(), 3000);
    ASSERT_EQ(W.cols(), tets.X.rows());
    EXPECT_LT((W * tets.X - points).cwiseAbs().maxCoeff(), 1e-14);
    EXPECT_LT(error_under_affine_motion(W, tets.X, points), 1e-14);
    EXPECT_LT((W * Eigen::VectorXd::Ones(W.cols()) - Eigen::VectorXd::Ones(3000)).cwiseAbs().maxCoeff(),
              1e-15);
    for (int p = 0; p < W.rows(); ++p)
        for (Embedding::InnerIterator w(W, p); w; ++w) {
            ASSERT_GE(w.value(), -1e-9);
            ASSERT_LE(w.value(), 1 + 1e-9);
            ASSERT_LT((tets.X.row(w.col()) - points.row(p)).norm(), 1) << "weight of a distant node";
        }
}

TEST(Embed, FollowsTheQuadraticMapOfQuadraticTetrahedra) {
    const TetMesh tets = make_quadratic(test::box_mesh({1, 2, 3}, {3, 3, 3}));
    const Nodes points = points_in({Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(1, 2, 3)}, 1000);
    const Embedding W = embed(tets, points);
    EXPECT_LT(error_under_affine_motion(W, tets.X, points), 1e-14);
    EXPECT_GE(Eigen::Map<const Eigen::VectorXd>(W.valuePtr(), W.nonZeros()).minCoeff(), 0);
    // x^2 has the control points x_a x_b on edges ab.
    Eigen::VectorXd square = tets.X.col(1).cwiseAbs2();
    for (Eigen::Index t = 0; t < tets.T.rows(); ++t)
        for (int k = 0; k < 6; ++k) {
            const auto [a, b] = edges_of_tet[k];
            square[tets.E(t, k)] = tets.X(tets.T(t, a), 1) * tets.X(tets.T(t, b), 1);
        }
    EXPECT_LT((W * square - points.col(1).cwiseAbs2()).cwiseAbs().maxCoeff(), 1e-13);
    // A point takes ten nodes inside, six on a face, three in the middle of an edge, one at a corner.
    const auto nodes_of = [&](const Eigen::RowVector3d& x) { return embed(tets, x).nonZeros(); };
    EXPECT_EQ(nodes_of(points.row(0)), 10);
    EXPECT_EQ(nodes_of({0, 0.21, 0.4}), 6);
    EXPECT_EQ(nodes_of(tets.X.row(tets.E(0, 0))), 3);
    EXPECT_EQ(nodes_of(tets.X.row(tets.T(0, 0))), 1);
}

TEST(Embed, UsesASingleNodeForAPointOnIt) {
    const TetMesh tets = test::box_mesh({1, 1, 1}, {3, 3, 3});
    const Embedding W = embed(tets, tets.X);
    EXPECT_EQ(W.nonZeros(), tets.X.rows());
    EXPECT_TRUE(Eigen::MatrixXd(W).isIdentity(0));
}

TEST(Embed, ExtrapolatesFromTheNearestTetrahedron) {
    const TetMesh tets = test::box_mesh({1, 1, 1}, {4, 4, 4});
    // Points slightly outside, all less than 0.1 from the box.
    Nodes points = points_in({Eigen::Vector3d(-0.05, -0.05, -0.05), Eigen::Vector3d(1.05, 1.05, 1.05)}, 2000);
    points.col(2) = (points.col(2).array() < 0.5).select(points.col(2).array() * 0.05 - 0.06, 1.03);
    const Embedding W = embed(tets, points);
    EXPECT_LT(error_under_affine_motion(W, tets.X, points), 1e-14);
    double least = 0;
    for (int p = 0; p < W.rows(); ++p)
        for (Embedding::InnerIterator w(W, p); w; ++w) {
            least = std::min(least, w.value());
            const double distance = (tets.X.row(w.col()) - points.row(p)).norm();
            ASSERT_LT(distance, 0.06 * std::sqrt(3.) + 0.25 * std::sqrt(3.)) << "not the nearest";
        }
    EXPECT_LT(least, -0.05) << "no point is extrapolated";
}

TEST(Embed, NamesTheFirstPointTooFarOutside) {
    const TetMesh tets = test::box_mesh({1, 1, 1}, {1, 1, 1});
    Nodes points(4, 3);
    points << 0.5, 0.5, 0.5, 0.5, 0.5, 1.4, 0.5, 0.75, 3, -1, 0.5, 0.5;
    const std::string error = error_of([&] { embed(tets, points); });
    EXPECT_EQ(error.find("vertex 2 at (0.5, 0.75, 3) is 2 m away from the nearest tetrahedron ("), 0u)
        << error;
    EXPECT_NE(error.find("more than 0.5 of its mean edge length 1.26008 m; 2 such vertices"),
              std::string::npos)
        << error;
}

TEST(Embed, RejectsInvalidInput) {
    const TetMesh good = test::box_mesh({1, 1, 1}, {1, 1, 1});
    Nodes point(1, 3);
    point << 0.5, 0.5, 0.5;
    EXPECT_EQ(error_of([&] { embed({good.X, Tets(0, 4)}, point); }), "no tetrahedra to embed in");
    TetMesh bad = good;
    bad.T(2, 1) = 8;
    EXPECT_EQ(error_of([&] { embed(bad, point); }), "tetrahedron 2 refers to node 8, but there are 8 nodes");
    bad = good;
    std::swap(bad.T(3, 0), bad.T(3, 1));
    EXPECT_EQ(error_of([&] { embed(bad, point); }),
              "tetrahedron 3 has volume -0.166667 m3; allowed: more than 0");
    point(0, 1) = std::numeric_limits<double>::quiet_NaN();
    EXPECT_EQ(error_of([&] { embed(good, point); }), "vertex 0 at (0.5, nan, 0.5) is not finite");
}

TEST(Embed, ComposesWithSubdivision) {
    const TetMesh tets = test::box_mesh({2, 2, 2}, {3, 3, 3});
    const TriMesh surface = box(2, 2, 2, 3);
    const Embedding W = embed(tets, surface.X);
    for (const SubdivisionScheme scheme : {SubdivisionScheme::midpoint, SubdivisionScheme::loop}) {
        const auto [fine, S] = subdivide(surface, scheme, 2);
        const Embedding composed = S * W;
        EXPECT_LT((composed * tets.X - fine.X).cwiseAbs().maxCoeff(), 1e-14);
        EXPECT_LT(error_under_affine_motion(composed, tets.X, fine.X), 1e-13);
        EXPECT_LT(error_under_affine_motion(embed(tets, fine.X), tets.X, fine.X), 1e-13)
            << "embedded directly";
    }
}

TEST(PointTriangle, AgreesWithSampledDistances) {
    const Nodes corners = points_in({Eigen::Vector3d(-1, -1, -1), Eigen::Vector3d(1, 1, 1)}, 160);
    int n = 40;
    for (int i = 0; i + 3 < corners.rows(); i += 4) {
        const Eigen::Vector3d p = corners.row(i), a = corners.row(i + 1), b = corners.row(i + 2),
                              c = corners.row(i + 3);
        double least = 1e9;
        for (int u = 0; u <= n; ++u)
            for (int v = 0; u + v <= n; ++v)
                least = std::min(least, (a + (b - a) * u / n + (c - a) * v / n - p).norm());
        const double distance = std::sqrt(squared_distance_to_triangle(p, a, b, c));
        EXPECT_LE(distance, least + 1e-12);
        EXPECT_GE(distance, least - 2.0 * std::sqrt(3.) / n);
        EXPECT_NEAR(squared_distance_to_triangle(p, a, b, a), squared_distance_to_triangle(p, b, a, b), 1e-12)
            << "segments";
        EXPECT_NEAR(squared_distance_to_triangle(p, a, a, a), (p - a).squaredNorm(), 1e-12) << "points";
    }
}

/// Tetrahedra of a cube come to hold one whose faces bulge by a twentieth, of 1 mm, 1 m and 100 m, a million
/// times as far off, too, with little more volume than it has.
TEST(Enclose, LetsTetrahedraHoldAllPoints) {
    Nodes bulging = test::box(2, 2, 2, 8).X.array() - 1;
    for (auto x : bulging.rowwise())
        for (int k = 0; k < 3; ++k)
            if (std::abs(std::abs(x[k]) - 1) < 1e-9)
                x[k] *= 1 + 0.05 * (1 - std::pow(x[(k + 1) % 3], 2)) * (1 - std::pow(x[(k + 2) % 3], 2));
    for (const double size : {1e-3, 1.0, 100.0})
        for (const double away : {0.0, 1e6}) {
            TetMesh tets = test::box_mesh({2, 2, 2}, {3, 3, 3});
            tets.X = (size * (tets.X.array() - 1 + away)).eval();
            const Nodes points = size * (bulging.array() + away);
            ASSERT_LT(embed(tets, points).coeffs().minCoeff(), -0.01);
            enclose(tets, points);
            EXPECT_GT(embed(tets, points).coeffs().minCoeff(), -1e-6) << size << ' ' << away;
            double all = 0;
            for (int t = 0; t < tets.T.rows(); ++t) {
                ASSERT_GT(volume(tets, t), 0);
                all += volume(tets, t);
            }
            EXPECT_GT(all, 8 * std::pow(size, 3));
            EXPECT_LT(all, 1.2 * 8 * std::pow(size, 3));
        }
}

}  // namespace
}  // namespace nbd
