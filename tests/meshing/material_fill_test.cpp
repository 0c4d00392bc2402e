#include "meshing/surface/material_fill.hpp"

#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include <Eigen/Geometry>
#include <numbers>

#include "meshing/surface/quadratic_tets.hpp"
#include "tests/meshing/shapes.hpp"
#include "tests/support/box_mesh.hpp"

namespace nbd {
namespace {

constexpr double beside = 1e-5;  // counted of what is not filled

/// The integrals of 1, x and x x^T over what fills the tetrahedra.
struct Integrals {
    double volume = 0;
    Eigen::Vector3d first = Eigen::Vector3d::Zero();
    Eigen::Matrix3d second = Eigen::Matrix3d::Zero();
};

Integrals integrals(const TetMesh& tets) {
    Integrals sums;
    for (int t = 0; t < tets.T.rows(); ++t) {
        Eigen::Matrix4d S;  // means of z z^T
        for (int a = 0; a < 4; ++a) S(a, a) = tets.fill(t, a);
        for (int k = 0; k < 6; ++k) {
            const auto [a, b] = edges_of_tet[k];
            S(a, b) = S(b, a) = tets.fill(t, 4 + k) / 2;
        }
        Eigen::Matrix<double, 4, 3> X;
        for (int a = 0; a < 4; ++a) X.row(a) = tets.X.row(tets.T(t, a));
        const double V = volume(tets, t);
        sums.volume += V * S.sum();
        sums.first += V * X.transpose() * S.rowwise().sum();
        sums.second += V * X.transpose() * S * X;
    }
    return sums;
}

/// Of a box.
Integrals integrals(const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
    const Eigen::Vector3d middle = (low + high) / 2, size = high - low;
    Integrals sums{size.prod(), size.prod() * middle, size.prod() * middle * middle.transpose()};
    for (int k = 0; k < 3; ++k) sums.second(k, k) += size.prod() * size[k] * size[k] / 12;
    return sums;
}

TetMesh filled(TetMesh tets, const TriMesh& solid) {
    tets.fill = material_fill(tets, solid);
    return tets;
}

/// Boxes within tetrahedra that do not know of them: far smaller and larger ones, and far away.
TEST(MaterialFill, HasVolumeCentreAndInertiaOfABox) {
    for (const double size : {1e-3, 1.0, 1e3})
        for (const Eigen::Vector3d& at : {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(1e3, -2e3, 5e2)}) {
            TetMesh tets = test::box_mesh({1, 1, 1}, {3, 3, 3}, 0.2);
            TriMesh box = test::moved(test::box(0.53, 0.71, 0.62, 2), 0.23, 0.17, 0.3);
            tets.X = size * (tets.X.rowwise() + at.transpose());
            box.X = size * (box.X.rowwise() + at.transpose());
            const Integrals got = integrals(filled(tets, box)),
                            box_alone = integrals(box.X.colwise().minCoeff().transpose(),
                                                  box.X.colwise().maxCoeff().transpose());
            EXPECT_NEAR(got.volume / box_alone.volume, 1, 2e-3) << size;
            const Eigen::Vector3d centre = got.first / got.volume,
                                  expected = box_alone.first / box_alone.volume;
            EXPECT_LT((centre - expected).norm(), 2e-3 * size) << size;
            const auto about_centre = [](const Integrals& of) -> Eigen::Matrix3d {
                return of.second / of.volume - of.first * of.first.transpose() / (of.volume * of.volume);
            };
            EXPECT_LT((about_centre(got) - about_centre(box_alone)).norm(),
                      0.01 * about_centre(box_alone).norm())
                << size;
        }
}

TEST(MaterialFill, IsATenthOfEachFunctionInsideAndNearlyNothingOutside) {
    const TetMesh tets = test::box_mesh({1, 1, 1}, {4, 4, 4});
    EXPECT_LT(
        (filled(tets, test::moved(test::box(3, 3, 3, 1), -1, -1, -1)).fill.array() - 0.1).abs().maxCoeff(),
        1e-12);
    EXPECT_LT((filled(tets, test::moved(test::box(1, 1, 1, 1), 5, 0, 0)).fill.array() - 0.1 * beside)
                  .abs()
                  .maxCoeff(),
              1e-12);
}

/// The faces of tetrahedra and those of the box lie on each other.
TEST(MaterialFill, TakesFacesOnFaces) {
    const TetMesh tets = test::box_mesh({1, 1, 1}, {4, 4, 4});
    EXPECT_NEAR(integrals(filled(tets, test::box(1, 1, 1, 4))).volume, 1, 1e-6);
    EXPECT_NEAR(integrals(filled(tets, test::moved(test::box(0.5, 0.5, 0.5, 4), 0.25, 0.25, 0.25))).volume,
                0.125, 1e-4);
}

TEST(MaterialFill, LeavesHollowsEmptyAndCountsOverlapsOnce) {
    const TetMesh tets = test::box_mesh({3, 3, 3}, {4, 4, 4});
    TriMesh outer = test::moved(test::icosphere(4), 1.5, 1.5, 1.5, 1.2),
            inner = test::moved(test::icosphere(4), 1.5, 1.5, 1.5, 0.9);
    inner.F.col(1).swap(inner.F.col(2));
    constexpr double ball = 4 * std::numbers::pi / 3;
    EXPECT_NEAR(integrals(filled(tets, test::joined(outer, inner))).volume,
                ball * (std::pow(1.2, 3) - std::pow(0.9, 3)), 0.02);
    const TriMesh a = test::moved(test::box(1, 1, 1, 1), 0.3, 0.4, 0.5),
                  b = test::moved(test::box(1, 1, 1, 1), 0.8, 0.4, 0.5);
    EXPECT_NEAR(integrals(filled(tets, test::joined(a, b))).volume, 1.5, 3e-3);
}

/// A plate of 1:150 that no axis and no tetrahedron looks along.
TEST(MaterialFill, FindsThinPlates) {
    constexpr double thickness = 1. / 150;
    const TetMesh tets = test::box_mesh({3, 3, 3}, {3, 3, 3});
    TriMesh plate = test::moved(test::box(1, 1, thickness, 1), -0.5, -0.5, -thickness / 2);
    const Eigen::Matrix3d turn =
        Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 0.5).normalized()).toRotationMatrix();
    plate.X = (plate.X * turn.transpose()).rowwise() + Eigen::RowVector3d(1.4, 1.5, 1.6);
    const Integrals got = integrals(filled(tets, plate));
    EXPECT_NEAR((got.volume - 27 * beside) / thickness, 1, 5e-3);
}

TEST(MaterialFill, DoesNotDependOnThreads) {
    const TetMesh tets = test::box_mesh({3, 3, 3}, {5, 5, 5}, 0.2);
    const TriMesh ball = test::moved(test::icosphere(3), 1.5, 1.5, 1.5);
    TetFill alone, beside_others;
    tbb::task_arena(1).execute([&] { alone = material_fill(tets, ball); });
    tbb::task_arena(3).execute([&] { beside_others = material_fill(tets, ball); });
    EXPECT_EQ(alone, beside_others);
}

}  // namespace
}  // namespace nbd
