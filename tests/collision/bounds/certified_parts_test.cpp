#include <gtest/gtest.h>

#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <memory>
#include <random>

#include "collision/bounds/certified/enclosing_ellipsoid.hpp"
#include "collision/bounds/certified/path_forest.hpp"
#include "collision/bounds/certified/segment_walk.hpp"
#include "collision/bounds/certified/solid_meter.hpp"
#include "collision/bounds/certified/squared_norm.hpp"
#include "collision/bounds/certified/tet_regions.hpp"
#include "tests/support/shapes.hpp"
#include "tests/support/solid_bodies.hpp"

namespace nbd {
namespace {

double draw(std::mt19937& random) { return static_cast<double>(shapes::uniform(random)); }

/// Matrices of many kinds and scales: general, rank 1 and 2, rotations and near-rotations.
Eigen::Matrix3d some_matrix(int kind, std::mt19937& random) {
    Eigen::Matrix3d A;
    for (double& a : A.reshaped()) a = draw(random);
    const Eigen::JacobiSVD<Eigen::Matrix3d> svd(A, Eigen::ComputeFullU | Eigen::ComputeFullV);
    const Eigen::Matrix3d Q = svd.matrixU() * svd.matrixV().transpose();
    switch (kind % 6) {
        case 0:
            return A;
        case 1:
            return A.col(0) * A.row(1);
        case 2:
            return svd.matrixU() * Eigen::Vector3d(1, 1, 0).asDiagonal() * svd.matrixV().transpose();
        case 3:
            return Q;
        case 4:
            return Q + 1e-7 * A;
        default:
            return std::pow(10, 15 * draw(random)) * A;
    }
}

template <class Real>
void expect_bounds_of_norms(double most_above) {
    constexpr int width = 4;
    using Lanes = Eigen::Array<Real, width, 1>;
    std::mt19937 random(1);
    double sum = 0;
    constexpr int count = 20'000;
    for (int i = 0; i < count; ++i) {
        std::array<Lanes, 9> entries;
        double truth[width];
        for (int lane = 0; lane < width; ++lane) {
            const Eigen::Matrix<Real, 3, 3> A = some_matrix(i + lane, random).cast<Real>();
            for (std::size_t k = 0; k < 9; ++k) entries[k][lane] = A.data()[k];
            truth[lane] = Eigen::JacobiSVD<Eigen::Matrix3d>(A.template cast<double>()).singularValues()[0];
        }
        const Lanes bound = squared_norm_bound(entries);
        for (int lane = 0; lane < width; ++lane) {
            const double norm = std::sqrt(static_cast<double>(bound[lane]));
            EXPECT_GE(norm, truth[lane] * (1 - 1e-14));
            EXPECT_LE(norm, truth[lane] * most_above);
            sum += norm / truth[lane] - 1;
        }
    }
    EXPECT_LT(sum / (count * width), 0.01);
}

TEST(SquaredNormBound, IsAtLeastTheNormAndTight) {
    expect_bounds_of_norms<double>(1.015);
    expect_bounds_of_norms<float>(1.03);
}

TEST(SquaredNormBound, IsZeroForZeroAndNanForNan) {
    using One = Eigen::Array<double, 1, 1>;
    std::array<One, 9> A;
    for (One& entry : A) entry.setZero();
    EXPECT_GE(squared_norm_bound(A)[0], 0);
    EXPECT_LT(squared_norm_bound(A)[0], 1e-300);
    A[4][0] = std::nan("");
    EXPECT_TRUE(std::isnan(squared_norm_bound(A)[0]));
}

TEST(EnclosingEllipsoid, ContainsItsPointsAndIsFlatForFlatPointSets) {
    std::mt19937 random(2);
    for (int i = 0; i < 300; ++i) {
        const double flat = i % 3 == 0 ? 0 : 1, size = std::pow(10, 3 * draw(random));
        std::vector<Eigen::Vector3d> points(static_cast<std::size_t>(1 + i % 40), Eigen::Vector3d::Zero());
        for (std::size_t k = 1; k < points.size(); ++k)
            points[k] = size * Eigen::Vector3d(draw(random), draw(random), flat * draw(random));
        const Ellipsoid around = enclosing_ellipsoid(points);
        if (points.size() == 1) {
            EXPECT_TRUE(around.B.isZero() && around.m.isZero());
            continue;
        }
        const Eigen::Matrix3d B = around.B.cast<double>();
        for (const Eigen::Vector3d& p : points)
            EXPECT_LE((B.inverse() * (p - around.m.cast<double>())).norm(), 1 + 1e-12);
        EXPECT_LT(B.norm(), 6 * size);
        if (flat == 0) {
            EXPECT_LT(B.row(2).norm(), 0.02 * B.norm());
        }
    }
}

TEST(SegmentWalk, StaysInsideAConvexBodyAndStopsAtAGap) {
    const TetMesh box = test::solid_box_mesh();
    const SegmentWalk walk(box);
    std::vector<std::vector<int>> tets_of(static_cast<std::size_t>(box.X.rows()));
    for (int t = 0; t < box.T.rows(); ++t)
        for (const int n : box.T.row(t)) tets_of[static_cast<std::size_t>(n)].push_back(t);
    std::mt19937 random(3);
    std::vector<SegmentWalk::Piece> pieces;
    int found = 0, tried = 0;
    for (int i = 0; i < 500; ++i) {
        const auto node = static_cast<int>(random() % static_cast<unsigned>(box.X.rows()));
        const Eigen::Vector3d p = box.X.row(node),
                              q(1.5 + 1.4 * draw(random), 0.5 + 0.4 * draw(random), 0.5 + 0.4 * draw(random));
        ++tried;
        if (!walk.inside(p, q, tets_of[static_cast<std::size_t>(node)], pieces)) continue;
        ++found;
        double sum = 0, at = 0;
        for (const SegmentWalk::Piece& piece : pieces) {
            sum += piece.share;
            const Eigen::Vector3d middle = p + (at + piece.share / 2) * (q - p);
            Eigen::Matrix3d D;
            for (int a = 0; a < 3; ++a)
                D.col(a) = (box.X.row(box.T(piece.tet, a + 1)) - box.X.row(box.T(piece.tet, 0))).transpose();
            const Eigen::Vector3d inside =
                D.inverse() * (middle - box.X.row(box.T(piece.tet, 0)).transpose());
            EXPECT_GT(inside.minCoeff(), -1e-6);
            EXPECT_LT(inside.sum(), 1 + 1e-6);
            at += piece.share;
        }
        EXPECT_NEAR(sum, 1, 1e-7);
    }
    EXPECT_GT(found, 9 * tried / 10);
    // A segment that begins outside of the tetrahedron named as its home, and would pass through it, is not
    // inside.
    for (int t = 0; t < box.T.rows(); ++t) {
        Eigen::Vector3d middle = Eigen::Vector3d::Zero();
        for (const int n : box.T.row(t)) middle += box.X.row(n).transpose() / 4;
        const int home[] = {t};
        EXPECT_TRUE(walk.inside(middle, middle + Eigen::Vector3d(1e-6, 2e-6, 3e-6), home, pieces)) << t;
        EXPECT_FALSE(walk.inside(middle - Eigen::Vector3d(9, 0, 0), middle, home, pieces)) << t;
    }

    const test::SolidBody fork = test::solid_fork();
    const SegmentWalk between(fork.solid);
    const auto nearest = [&](const Eigen::RowVector3d& p) {
        Eigen::Index best = 0;
        (fork.solid.X.rowwise() - p).rowwise().norm().minCoeff(&best);
        return static_cast<int>(best);
    };
    const int top = nearest({3, 0.5, 1}), bottom = nearest({3, 0.5, 0});
    std::vector<int> homes;
    for (int t = 0; t < fork.solid.T.rows(); ++t)
        if ((fork.solid.T.row(t).array() == top).any()) homes.push_back(t);
    EXPECT_FALSE(between.inside(fork.solid.X.row(top), fork.solid.X.row(bottom), homes, pieces));
    const TetRegions one{std::vector<int>(static_cast<std::size_t>(fork.solid.T.rows()), 0), {0, 1}, {0}};
    const SolidGraph graph(fork.solid, fork.W, fork.F, one.of_tet);
    PathForest forest(graph);
    forest.grow(top, PathForest::unreached, {}, 0);
    EXPECT_GT(forest.distance(bottom), 4);  // the path goes around the gap
    double length = 0;
    EXPECT_EQ(forest.walk(bottom, [&](const SolidGraph::Link& link) { length += link.length; }), top);
    EXPECT_NEAR(length, forest.distance(bottom), 1e-9);
}

TEST(TetRegions, PartitionTheTetrahedraAndSampleTheirOwn) {
    for (const test::SolidBody& body : test::solid_bodies())
        for (const int splits : {0, 2}) {
            const SphereTree tree = build_sphere_tree(body.X, body.F, {.depth = 4, .min_leaf_faces = 2});
            const TetRegions regions = tet_regions(tree, body.solid, body.W, {.splits = splits});
            check_tet_regions(regions, static_cast<int>(body.solid.T.rows()));
            for (int r = 0; r < regions.count(); ++r)
                for (int k = regions.sample_begin[static_cast<std::size_t>(r)];
                     k < regions.sample_begin[static_cast<std::size_t>(r) + 1]; ++k)
                    EXPECT_EQ(
                        regions
                            .of_tet[static_cast<std::size_t>(regions.samples[static_cast<std::size_t>(k)])],
                        r);
            const auto leaves = std::ranges::count_if(tree.nodes, &SphereTree::Node::is_leaf);
            EXPECT_LE(regions.count(), leaves << splits);
            EXPECT_GT(regions.count(), 4);
        }
}

TEST(SolidMeter, BoundsTheSingularValuesAndDeviationsOfEveryTetrahedron) {
    const test::SolidBody body = test::solid_box();
    const SphereTree tree = build_sphere_tree(body.X, body.F, {.depth = 4});
    const auto regions = std::make_shared<const TetRegions>(tet_regions(tree, body.solid, body.W));
    SolidMeter meter(body.solid, regions);
    for (int i = 0; i < test::pose_kinds; ++i) {
        const Vertices nodes = test::solid_pose(body, i);
        const std::span<const RegionMotion> motions = meter.measure(nodes);
        std::vector<double> stretch(motions.size()), deviation(motions.size());
        for (int t = 0; t < body.solid.T.rows(); ++t) {
            Eigen::Matrix3d D, d;
            for (int a = 0; a < 3; ++a) {
                D.col(a) = (body.solid.X.row(body.solid.T(t, a + 1)) - body.solid.X.row(body.solid.T(t, 0)))
                               .transpose();
                d.col(a) = (nodes.row(body.solid.T(t, a + 1)).cast<double>() -
                            nodes.row(body.solid.T(t, 0)).cast<double>())
                               .transpose();
            }
            const auto norm = [](const Eigen::Matrix3d& A) {
                return Eigen::JacobiSVD<Eigen::Matrix3d>(A).singularValues()[0];
            };
            const Eigen::Matrix3d F = d * D.inverse();
            const auto r = static_cast<std::size_t>(regions->of_tet[static_cast<std::size_t>(t)]);
            stretch[r] = std::max(stretch[r], norm(F));
            deviation[r] = std::max(deviation[r], norm(F - motions[r].G.cast<double>()));
        }
        for (std::size_t r = 0; r < motions.size(); ++r) {
            EXPECT_GE(motions[r].stretch, stretch[r] * (1 - 1e-12));
            EXPECT_LE(motions[r].stretch, stretch[r] * 1.02);
            EXPECT_GE(motions[r].deviation, deviation[r] * (1 - 1e-9));
            EXPECT_LE(motions[r].deviation, deviation[r] * 1.02 + 1e-6 * stretch[r]);
        }
    }
}

}  // namespace
}  // namespace nbd
