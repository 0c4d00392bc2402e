#include "sim/fem/elastic_body.hpp"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <string>
#include <string_view>

#include "meshing/surface/quadratic_tets.hpp"
#include "sim/fem/stress.hpp"
#include "tests/sim/support/matrices.hpp"
#include "tests/support/box_mesh.hpp"

namespace nbd {
namespace {

const Eigen::Vector3d size(1, 0.6, 0.8);

constexpr const char* regions_of_all_laws = "regions_of_all_laws";

/// A bar of one law, or of two regions in a third material. Its batches of tetrahedra mix the laws. Kinds
/// that start with "quadratic_" have quadratic tetrahedra, and with "quadratic_rubber_" their mean dilatation
/// counts.
ElasticBody bar(std::string kind) {
    constexpr std::string_view quadratic = "quadratic_";
    TetMesh tets = test::box_mesh(size, {4, 3, 3}, 0.2);
    if (kind.starts_with(quadratic)) {
        tets = make_quadratic(test::box_mesh(size, {3, 2, 2}, 0.2));
        kind = kind.substr(quadratic.size());
    }
    Material material{.young = 2e5, .poisson = 0.3};
    constexpr std::string_view rubber = "rubber_";
    if (kind.starts_with(rubber)) {
        material.poisson = 0.498;
        kind = kind.substr(rubber.size());
    }
    if (kind != regions_of_all_laws) {
        material.law = material_law(kind).value();
        return {std::move(tets), material};
    }
    MaterialRegion soft{.name = "soft", .material = material, .tets = {}};
    soft.material.law = MaterialLaw::stable_neo_hookean;
    soft.material.young = 4e4;
    soft.material.poisson = 0.45;
    soft.material.density = 500;
    MaterialRegion stiff{.name = "stiff", .material = material, .tets = {}};
    stiff.material.law = MaterialLaw::st_venant_kirchhoff;
    stiff.material.young = 3e5;
    stiff.material.density = 1500;
    for (int t = 0; t < tets.T.rows(); ++t)
        if (t % 3 != 0) (t % 3 == 1 ? soft : stiff).tets.push_back(t);
    return {std::move(tets), material, {soft, stiff}};
}

/// Tests of every law and of a body with regions.
class EveryMaterial : public ::testing::TestWithParam<const char*> {
 protected:
    const ElasticBody body = bar(GetParam());
};

INSTANTIATE_TEST_SUITE_P(ElasticBody, EveryMaterial,
                         ::testing::Values("corotated", "stable_neo_hookean", "st_venant_kirchhoff",
                                           regions_of_all_laws, "quadratic_corotated",
                                           "quadratic_stable_neo_hookean", "quadratic_st_venant_kirchhoff",
                                           "quadratic_regions_of_all_laws", "quadratic_rubber_corotated",
                                           "quadratic_rubber_stable_neo_hookean",
                                           "quadratic_rubber_st_venant_kirchhoff",
                                           "quadratic_rubber_regions_of_all_laws"),
                         [](const auto& test) { return std::string(test.param); });

Nodes forces_at(const ElasticBody& body, const Nodes& x) {
    ElementPose pose;
    ElementForces forces;
    body.pose(x, pose, forces);
    Nodes f(x.rows(), 3);
    body.sum_forces(forces, f);
    return f;
}

double energy_at(const ElasticBody& body, const Nodes& x) { return body.measure(x).energy; }

Nodes moved(const Nodes& X, const Eigen::Matrix3d& A, const Eigen::Vector3d& b) {
    return (X * A.transpose()).rowwise() + b.transpose();
}

const Eigen::Matrix3d turn =
    Eigen::AngleAxisd(2.1, Eigen::Vector3d(1, -2, 0.5).normalized()).toRotationMatrix();

TEST_P(EveryMaterial, RigidMotionGivesNoForceAndNoEnergy) {
    const Nodes x = moved(body.rest().X, turn, {3, -1, 2});
    const double scale = forces_at(body, moved(body.rest().X, 1.1 * turn, {3, -1, 2})).cwiseAbs().maxCoeff();
    ASSERT_GT(scale, 1);
    EXPECT_LT(forces_at(body, x).cwiseAbs().maxCoeff(), 1e-12 * scale);
    EXPECT_LT(std::abs(energy_at(body, x)),
              1e-14 * energy_at(body, moved(body.rest().X, 1.1 * turn, {3, -1, 2})));
}

/// Positions near 1000 m are rounded to 1e-13 m; elements measure about 0.2 m.
TEST_P(EveryMaterial, EverythingTurnsAlongWithALargeRigidMotion) {
    constexpr double rounding = 1e-11;
    const double wildness = body.rest().is_quadratic() ? 0.15 : 0.08;
    const Nodes x = body.rest().X + test::wild_field(body.rest().X, wildness);
    const Nodes y = moved(x, turn, {700, -900, 400});
    const ElementReport here = body.measure(x), there = body.measure(y);
    ASSERT_GT(here.inverted, 0);
    EXPECT_EQ(there.inverted, here.inverted);
    EXPECT_EQ(there.first_inverted, here.first_inverted);
    EXPECT_NEAR(there.min_det, here.min_det, rounding);
    EXPECT_NEAR(there.energy, here.energy, rounding * here.energy);
    const Nodes f = forces_at(body, x), u = test::wild_field(body.rest().X, 2);
    EXPECT_LT((forces_at(body, y) - f * turn.transpose()).norm(), rounding * f.norm());
    const Eigen::VectorXd stress = von_mises_stress(body, x);
    EXPECT_LT((von_mises_stress(body, y) - stress).cwiseAbs().maxCoeff(), rounding * stress.maxCoeff());
    ElementPose pose, moved_pose;
    ElementForces forces;
    body.pose(x, pose, forces);
    body.pose(y, moved_pose, forces);
    const Nodes Ku = test::tangent_product(body, pose, u),
                moved_Ku = test::tangent_product(body, moved_pose, u * turn.transpose());
    EXPECT_LT((moved_Ku - Ku * turn.transpose()).norm(), rounding * Ku.norm());
}

TEST_P(EveryMaterial, ForcesSumToZeroForceAndZeroTorque) {
    const Nodes x = body.rest().X + test::wild_field(body.rest().X, 0.03);
    const Nodes f = forces_at(body, x);
    Eigen::Vector3d torque = Eigen::Vector3d::Zero();
    for (Eigen::Index i = 0; i < x.rows(); ++i)
        torque += Eigen::Vector3d(x.row(i)).cross(Eigen::Vector3d(f.row(i)));
    EXPECT_LT(f.colwise().sum().norm(), 1e-12 * f.norm());
    EXPECT_LT(torque.norm(), 1e-12 * f.norm());
}

// The force is the exact derivative of the energy, even far from rest and with inverted elements.
TEST_P(EveryMaterial, ForceIsMinusTheDerivativeOfTheEnergy) {
    for (const double wildness : {0.03, 0.15}) {
        const Nodes x = body.rest().X + test::wild_field(body.rest().X, wildness);
        EXPECT_EQ(body.measure(x).inverted > 0, wildness > 0.1);
        const Nodes f = forces_at(body, x);
        const double h = 1e-6;
        for (int i = 0; i < body.node_count(); i += 3)
            for (int c = 0; c < 3; ++c) {
                Nodes a = x, b = x;
                a(i, c) -= h;
                b(i, c) += h;
                const double slope = (energy_at(body, b) - energy_at(body, a)) / (2 * h);
                EXPECT_NEAR(f(i, c), -slope, 1e-6 * f.cwiseAbs().maxCoeff()) << i << ' ' << c;
            }
    }
}

/// Compares products with the tangent at x with differences of forces.
void expect_exact_tangent(const ElasticBody& body, const Nodes& x, Tangent tangent) {
    ElementPose pose;
    ElementForces forces;
    body.pose(x, pose, forces, tangent);
    const Nodes u = test::wild_field(body.rest().X, 1);
    const double h = 1e-6;
    const Nodes change = (forces_at(body, x - h * u) - forces_at(body, x + h * u)) / (2 * h),
                Ku = test::tangent_product(body, pose, u);
    EXPECT_LT((change - Ku).norm(), 1e-6 * Ku.norm());
}

TEST_P(EveryMaterial, TangentIsExactForARotatedBody) {
    expect_exact_tangent(body, moved(body.rest().X, turn, {1, 0, 0}), Tangent::rotated);
}

/// In slight tension no eigenvalue is negative, so nothing of the full tangent is left out.
TEST_P(EveryMaterial, FullTangentIsExactInTension) {
    Eigen::Array3d stretches(1.04, 1.02, 1.01);
    const bool is_rubber = body.mean_lambda(0) > body.moduli(0).mu;
    if (is_rubber) stretches = 1 + (stretches - 1) / 100;  // more would tear it open
    const Eigen::Matrix3d stretch = stretches.matrix().asDiagonal();
    expect_exact_tangent(body, moved(body.rest().X, turn * stretch, {1, 0, 0}), Tangent::full);
}

using EveryLaw = EveryMaterial;

INSTANTIATE_TEST_SUITE_P(ElasticBody, EveryLaw,
                         ::testing::Values("corotated", "stable_neo_hookean", "st_venant_kirchhoff",
                                           "quadratic_corotated", "quadratic_stable_neo_hookean",
                                           "quadratic_st_venant_kirchhoff", "quadratic_rubber_corotated",
                                           "quadratic_rubber_stable_neo_hookean",
                                           "quadratic_rubber_st_venant_kirchhoff"),
                         [](const auto& test) { return std::string(test.param); });

/// Every interior node of a uniformly strained body is in balance.
TEST_P(EveryLaw, PassesThePatchTest) {
    Eigen::Matrix3d F;
    F << 1.2, 0.1, 0, -0.05, 0.8, 0.2, 0.1, 0, 1.1;
    const Nodes f = forces_at(body, moved(body.rest().X, F, {0, 1, 0}));
    const Eigen::Vector3d low = body.rest().X.colwise().minCoeff(), high = body.rest().X.colwise().maxCoeff();
    int interior = 0;
    for (Eigen::Index i = 0; i < f.rows(); ++i) {
        const Eigen::Array3d X = body.rest().X.row(i).transpose();
        if (!(X > low.array() + 1e-9).all() || !(X < high.array() - 1e-9).all()) continue;
        ++interior;
        EXPECT_LT(f.row(i).norm(), 1e-12 * f.norm());
    }
    EXPECT_GT(interior, 0);
}

TEST_P(EveryMaterial, TangentIsSymmetricAndPositiveSemiDefiniteInEveryPose) {
    ElementPose pose;
    ElementForces forces;
    const Nodes x = body.rest().X + test::wild_field(body.rest().X, 0.15);
    ASSERT_GT(body.measure(x).inverted, 0);
    body.pose(x, pose, forces);
    const Eigen::MatrixXd K = test::combined(body, 0, 1, pose);
    EXPECT_TRUE(K == K.transpose());
    const Eigen::VectorXd values =
        Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(K, Eigen::EigenvaluesOnly).eigenvalues();
    EXPECT_GT(values.minCoeff(), -1e-6 * values.maxCoeff());  // single precision
}

/// Damping between two poses, and what it does to the way between them.
Nodes damping_force(const ElasticBody& body, const Nodes& from, const Nodes& to) {
    const Nodes way = to - from;
    const StepMotion motion{.w = way, .dt = 1, .strain_rate_at = 0.5, .damping = 0.3};
    ElementPose pose;
    ElementForces forces;
    body.pose(to, pose, forces, Tangent::full, &motion);
    Nodes out(to.rows(), 3);
    body.damping_product(pose, to - from, forces, out);
    return out;
}

TEST_P(EveryMaterial, DampingIsZeroForARotationOfAnySizeInEveryPose) {
    const Nodes strained = body.rest().X + test::wild_field(body.rest().X, 0.08);
    const Nodes other = strained + test::wild_field(body.rest().X, 0.02);
    const double size = damping_force(body, strained, other).norm();
    ASSERT_GT(size, 1);
    for (const double angle : {0.01, 0.5, 2.0}) {
        const Eigen::Matrix3d turn =
            Eigen::AngleAxisd(angle, Eigen::Vector3d(1, 2, -1).normalized()).toRotationMatrix();
        EXPECT_LT(damping_force(body, strained, moved(strained, turn, {1, 0, 2})).norm(), 1e-12 * size);
    }
}

TEST_P(EveryMaterial, DampingIsTheStiffnessAtRestAndTakesEnergyWithoutATorque) {
    const Nodes &X = body.rest().X, u = test::wild_field(X, 1e-6);
    ElementPose pose;
    ElementForces forces;
    body.pose(X, pose, forces);
    const Nodes Ku = test::tangent_product(body, pose, u);
    EXPECT_LT((damping_force(body, X, X + u) - Ku).norm(), 1e-4 * Ku.norm());
    const Nodes from = X + test::wild_field(X, 0.08), to = from + test::wild_field(X.array() + 1, 0.05);
    const Nodes force = damping_force(body, from, to), halfway = (from + to) / 2;
    EXPECT_GT(force.cwiseProduct(to - from).sum(), 0);
    Eigen::Vector3d torque = Eigen::Vector3d::Zero();
    for (Eigen::Index i = 0; i < X.rows(); ++i)
        torque += Eigen::Vector3d(halfway.row(i)).cross(Eigen::Vector3d(force.row(i)));
    EXPECT_LT(torque.norm(), 1e-12 * force.norm());
}

/// K + damping D, of both kinds of tangent.
TEST_P(EveryMaterial, ProductsWithDampingAgreeWithTheMatrix) {
    const Nodes x = body.rest().X + test::wild_field(body.rest().X, 0.08);
    const Nodes u = test::wild_field(body.rest().X, 1);
    const StepMotion motion{.w = u, .dt = 0.1, .damping = 0.7};
    for (const Tangent tangent : {Tangent::rotated, Tangent::full}) {
        ElementPose pose, undamped;
        ElementForces scratch;
        body.pose(x, pose, scratch, tangent, &motion);
        body.pose(x, undamped, scratch, tangent);
        const Nodes product = test::tangent_product(body, pose, u),
                    Ku = test::tangent_product(body, undamped, u);
        Nodes Du(u.rows(), 3);
        body.damping_product(pose, u, scratch, Du);
        EXPECT_LT((product - Ku - 0.7 * Du).norm(), 1e-13 * product.norm());
        const Eigen::VectorXd expected =
            test::combined(body, 0, 1, pose) * Eigen::Map<const Eigen::VectorXd>(u.data(), u.size());
        EXPECT_LT((Eigen::Map<const Eigen::VectorXd>(product.data(), product.size()) - expected).norm(),
                  1e-6 * expected.norm());
    }
}

ElementPose bent_pose(const ElasticBody& body) {
    ElementPose pose;
    ElementForces forces;
    body.pose(body.rest().X + test::wild_field(body.rest().X, 0.03), pose, forces);
    return pose;
}

TEST_P(EveryMaterial, ProductsAgreeWithTheMatrices) {
    const ElementPose pose = bent_pose(body);
    const Nodes u = test::wild_field(body.rest().X, 1);
    const Eigen::Map<const Eigen::VectorXd> flat(u.data(), u.size());
    StepMatrix A = body.zero_matrix();
    body.combine(0.7, 0.2, pose, A);
    const Eigen::VectorXd expected = test::sparse(body, A) * flat;
    const Nodes sum = 0.7 * body.mass_product(u) + 0.2 * test::tangent_product(body, pose, u);
    EXPECT_LT((Eigen::Map<const Eigen::VectorXd>(sum.data(), sum.size()) - expected).norm(),
              1e-6 * expected.norm());  // single precision
    for (int i = 0; i < body.node_count(); ++i)
        EXPECT_LT((A.multiply_row(i, flat.data()) - expected.segment<3>(3 * i)).norm(),
                  1e-13 * expected.norm());
}

TEST(ElasticBody, ReportsInvertedAndNonFiniteElements) {
    const ElasticBody body(test::box_mesh({1, 1, 1}, {1, 1, 1}), Material{});
    ElementReport report = body.measure(body.rest().X);
    EXPECT_TRUE(report.ok());
    EXPECT_NEAR(report.min_det, 1, 1e-14);
    EXPECT_NEAR(report.stretch, std::sqrt(3), 1e-14);

    Nodes mirrored = body.rest().X;
    mirrored.col(0) *= -1;
    report = body.measure(mirrored);
    EXPECT_EQ(report.inverted, 6);
    EXPECT_EQ(report.first_inverted, 0);
    EXPECT_NEAR(report.min_det, -1, 1e-14);

    Nodes broken = body.rest().X;
    const int alone = 1;  // a corner of only some of the six tetrahedra
    broken(alone, 2) = std::numeric_limits<double>::quiet_NaN();
    report = body.measure(broken);
    EXPECT_FALSE(report.ok());
    EXPECT_EQ(report.non_finite, (body.rest().T.array() == alone).count());
    EXPECT_LT(report.non_finite, 6);
    EXPECT_EQ((body.rest().T.row(report.first_non_finite).array() == alone).count(), 1);
}

TEST_P(EveryMaterial, TheRestStiffnessIsThatOfTheRestPose) {
    ElementPose pose;
    ElementForces forces;
    body.pose(body.rest().X, pose, forces);
    const SparseMatrix rest = body.rest_stiffness();
    EXPECT_LT((test::combined(body, 0, 1, pose) - rest).norm(), 1e-6 * rest.norm());
    EXPECT_LT((rest * Eigen::VectorXd::Ones(rest.cols())).norm(), 1e-12 * rest.norm());
}

/// A translation costs no force, although the blocks are rounded.
TEST_P(EveryMaterial, MatricesAreBalanced) {
    const SparseMatrix K = test::combined(body, 0, 1, bent_pose(body));
    const Eigen::VectorXd shift = Eigen::Vector3d(1, -2, 3).replicate(body.node_count(), 1);
    EXPECT_LT((K * shift).norm(), 1e-7 * K.norm());
}

TEST(ElasticBody, HasTheMassAndTheVolumeOfItsRegions) {
    const ElasticBody body = bar(regions_of_all_laws);
    EXPECT_NEAR(body.rest_volumes().sum(), size.prod(), 1e-13);
    double mass = 0;
    for (int t = 0; t < body.element_count(); ++t)
        mass += (t % 3 == 0 ? 1000 : t % 3 == 1 ? 500 : 1500) * body.rest_volumes()[t];
    EXPECT_NEAR(body.mass(), mass, 1e-10);
    EXPECT_EQ(body.young(0), 2e5);
    EXPECT_EQ(body.young(1), 4e4);
    EXPECT_EQ(body.young(2), 3e5);
}

}  // namespace
}  // namespace nbd
