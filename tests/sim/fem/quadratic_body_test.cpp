// Quadratic tetrahedra against their definition; elastic_body_test.cpp has what both kinds share.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>

#include "meshing/surface/quadratic_tets.hpp"
#include "sim/fem/elastic_body.hpp"
#include "sim/fem/stress.hpp"
#include "tests/support/box_mesh.hpp"

namespace nbd {
namespace {

/// F of the quadratic map sum z_a^2 x_a + sum 2 z_a z_b x_ab at a point of a tetrahedron, by differences of
/// the map.
Eigen::Matrix3d gradient_by_differences(const TetMesh& mesh, const Nodes& x, int t,
                                        const Eigen::Vector4d& z) {
    const auto place = [&](const Nodes& nodes, const Eigen::Vector4d& at) {
        Eigen::Vector3d sum = Eigen::Vector3d::Zero();
        for (int a = 0; a < 4; ++a) sum += at[a] * at[a] * nodes.row(mesh.T(t, a)).transpose();
        for (int k = 0; k < 6; ++k) {
            const auto [a, b] = edges_of_tet[k];
            sum += 2 * at[a] * at[b] * nodes.row(mesh.E(t, k)).transpose();
        }
        return sum;
    };
    Eigen::Matrix3d rest, now;
    for (int k = 0; k < 3; ++k) {
        Eigen::Vector4d step = Eigen::Vector4d::Zero();
        step[0] = -1e-3;
        step[k + 1] = 1e-3;
        rest.col(k) = place(mesh.X, z + step) - place(mesh.X, z - step);
        now.col(k) = place(x, z + step) - place(x, z - step);
    }
    return now * rest.inverse();
}

TEST(QuadraticBody, HasTheGradientsOfTheQuadraticMap) {
    const ElasticBody body(make_quadratic(test::box_mesh({1, 0.6, 0.8}, {3, 2, 2}, 0.2)), Material{});
    const Nodes x = body.rest().X + test::wild_field(body.rest().X, 0.05);
    const ElementStress stress = element_stress(body, x);
    ASSERT_EQ(stress.F.rows(), 3 * 4 * body.element_count());
    for (int t = 0; t < body.element_count(); ++t)
        for (int p = 0; p < 4; ++p) {
            Eigen::Vector4d z = Eigen::Vector4d::Constant((5 - std::sqrt(5)) / 20);
            z[p] = (5 + 3 * std::sqrt(5)) / 20;
            const Eigen::Matrix3d F = stress.F.middleRows<3>(3 * (4 * t + p)).cast<double>();
            EXPECT_LT((F - gradient_by_differences(body.rest(), x, t, z)).norm(), 1e-5) << t << ' ' << p;
        }
}

/// Quadratic displacements u_i = X^T H_i X / 2 of a unit box, under the load that holds them: minus
/// (lambda + mu) grad div u + mu laplace u.
TEST(QuadraticBody, HoldsQuadraticDisplacementsInEquilibrium) {
    const ElasticBody body(make_quadratic(test::box_mesh({1, 1, 1}, {3, 3, 3}, 0.3)),
                           Material{.poisson = 0.3, .density = 1});
    std::array<Eigen::Matrix3d, 3> H;
    H[0] << 1, -2, 0.5, -2, 3, 1, 0.5, 1, -1;
    H[1] << -2, 1, 1.5, 1, 0.5, -1, 1.5, -1, 2;
    H[2] << 0.5, 2, -1, 2, 1, 3, -1, 3, 1.5;
    const auto& [law, mu, lambda] = body.moduli(0);
    Eigen::RowVector3d load = Eigen::RowVector3d::Zero();
    for (int i = 0; i < 3; ++i) {
        load -= (lambda + mu) * H[i].row(i);
        load[i] -= mu * H[i].trace();
    }
    const TetMesh& mesh = body.rest();
    Nodes u(mesh.X.rows(), 3);
    const auto set = [&](int node, const Eigen::RowVector3d& a, const Eigen::RowVector3d& b) {
        for (int i = 0; i < 3; ++i) u(node, i) = 0.5 * a.dot(H[i] * b.transpose());
    };
    for (Eigen::Index t = 0; t < mesh.T.rows(); ++t) {
        for (const int node : mesh.T.row(t)) set(node, mesh.X.row(node), mesh.X.row(node));
        for (int k = 0; k < 6; ++k)
            set(mesh.E(t, k), mesh.X.row(mesh.T(t, edges_of_tet[k].first)),
                mesh.X.row(mesh.T(t, edges_of_tet[k].second)));
    }
    const Eigen::VectorXd force = body.rest_stiffness() * u.reshaped<Eigen::RowMajor>();
    const Nodes outer = body.node_masses() * load;
    double left = 0, size = 0;
    for (Eigen::Index i = 0; i < u.rows(); ++i)
        if (mesh.X.row(i).minCoeff() > 1e-9 && mesh.X.row(i).maxCoeff() < 1 - 1e-9) {
            left = std::max(left, (force.segment<3>(3 * i) - outer.row(i).transpose()).norm());
            size = std::max(size, outer.row(i).norm());
        }
    EXPECT_GT(size, 0);
    EXPECT_LT(left, 1e-10 * size);
}

/// Kinetic energies of quadratic velocities and of rigid rotations, by integrals over the box.
TEST(QuadraticBody, HasTheConsistentMassOfQuadraticElements) {
    const ElasticBody body(make_quadratic(test::box_mesh({1, 1, 1}, {2, 2, 2})), Material{.density = 3});
    EXPECT_NEAR(body.mass(), 3, 1e-13);
    EXPECT_NEAR(body.node_masses().minCoeff(), 3.0 / 48 / 10, 1e-13);
    const Nodes& X = body.rest().X;
    EXPECT_NEAR(X.col(0).dot(body.mass_product(X).col(0)), 3.0 / 3, 1e-13) << "integral of density x^2";
    // x^2 has the control points x_a x_b on edges ab.
    Nodes square = X.cwiseAbs2();
    for (Eigen::Index t = 0; t < body.rest().T.rows(); ++t)
        for (int k = 0; k < 6; ++k) {
            const auto [a, b] = edges_of_tet[k];
            square.row(body.rest().E(t, k)) =
                X.row(body.rest().T(t, a)).cwiseProduct(X.row(body.rest().T(t, b)));
        }
    EXPECT_NEAR(square.col(1).dot(body.mass_product(square).col(1)), 3.0 / 5, 1e-13);
    const SparseMatrix M = body.mass_matrix();
    EXPECT_NEAR(square.reshaped<Eigen::RowMajor>().dot(M * square.reshaped<Eigen::RowMajor>()), 9.0 / 5,
                1e-13);
}

TEST(QuadraticBody, CountsInvertedQuadraticTetrahedraOnce) {
    const ElasticBody body(make_quadratic(test::box_mesh({1, 1, 1}, {1, 1, 1})), Material{});
    Nodes mirrored = body.rest().X;
    mirrored.col(0) *= -1;
    const ElementReport report = body.measure(mirrored);
    EXPECT_EQ(report.inverted, 6);
    EXPECT_EQ(report.first_inverted, 0);
    EXPECT_NEAR(report.min_det, -1, 1e-13);
}

}  // namespace
}  // namespace nbd
