// Tetrahedra that material fills in part.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <random>

#include "meshing/cage/cage_body.hpp"
#include "meshing/surface/material_fill.hpp"
#include "meshing/surface/quadratic_tets.hpp"
#include "sim/fem/elastic_body.hpp"
#include "sim/fem/modes.hpp"
#include "sim/fem/momentum.hpp"
#include "sim/fem/quadratic_points.hpp"
#include "tests/meshing/shapes.hpp"
#include "tests/support/box_mesh.hpp"

namespace nbd {
namespace {

TEST(PointsOfFill, AreTheUsualOnesInAFullTetrahedron) {
    const TetPoints points = points_of_fill(Eigen::Matrix<double, 1, 10>::Constant(0.1));
    for (int p = 0; p < 4; ++p)
        for (int a = 0; a < 4; ++a)
            EXPECT_NEAR(points(p, a), p == a ? (5 + 3 * std::sqrt(5)) / 20 : (5 - std::sqrt(5)) / 20, 1e-14);
}

/// Of masses at random places, also at few of them.
TEST(PointsOfFill, HaveTheMeansOfWhatFills) {
    std::mt19937 random(3);
    std::gamma_distribution<double> share(1);
    for (int places = 1; places < 40; ++places) {
        Eigen::Matrix4d S = Eigen::Matrix4d::Zero();
        double whole = 0;
        for (int i = 0; i < places; ++i) {
            Eigen::Vector4d z(share(random), share(random), share(random), share(random));
            z /= z.sum();
            const double mass = share(random) / 100;
            S += mass * z * z.transpose();
            whole += mass;
        }
        Eigen::Matrix<double, 1, 10> fill;
        for (int a = 0; a < 4; ++a) fill[a] = S(a, a);
        for (int k = 0; k < 6; ++k) fill[4 + k] = 2 * S(edges_of_tet[k].first, edges_of_tet[k].second);
        const TetPoints points = points_of_fill(fill);
        EXPECT_LT((points.rowwise().sum() - Eigen::Vector4d::Ones()).norm(), 1e-7) << places;
        EXPECT_LT((points.transpose() * points / 4 - S / whole).norm(), 1e-7) << places;
    }
}

/// A bar that lies askew in a box of tetrahedra.
struct Askew {
    Eigen::Vector3d size{1.4, 0.3, 0.2};
    Eigen::Matrix3d turn = Eigen::AngleAxisd(0.4, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix();
    TetMesh tets;

    explicit Askew(Elements elements) {
        TriMesh bar = test::box(size[0], size[1], size[2], 3);
        bar.X = ((bar.X.rowwise() - size.transpose() / 2) * turn.transpose()).rowwise() +
                Eigen::RowVector3d(1, 1, 1);
        tets = as_elements(test::box_mesh({2, 2, 2}, {5, 5, 5}, 0.1), elements);
        tets.fill = material_fill(tets, bar);
    }
};

TEST(FilledBody, HasMassCentreAndInertiaOfTheSolid) {
    for (const Elements elements : {Elements::linear, Elements::quadratic}) {
        const Askew bar(elements);
        const ElasticBody body(bar.tets, Material{.density = 500});
        const double mass = 500 * bar.size.prod();
        EXPECT_NEAR(body.mass(), mass, 2e-3 * mass);
        EXPECT_GT(body.node_masses().minCoeff(), 0);
        EXPECT_LT((centre_of_mass(body, body.rest().X) - Eigen::Vector3d(1, 1, 1)).norm(), 1e-3);
        if (elements == Elements::linear) continue;  // lumped at nodes
        Eigen::Matrix3d expected = Eigen::Matrix3d::Zero();
        for (int k = 0; k < 3; ++k)
            expected(k, k) = mass / 12 * (bar.size.squaredNorm() - bar.size[k] * bar.size[k]);
        expected = (bar.turn * expected * bar.turn.transpose()).eval();
        const Eigen::Matrix3d inertia = rigid_inertia(body, body.rest().X).bottomRightCorner<3, 3>();
        EXPECT_LT((inertia - expected).norm(), 1e-2 * expected.norm());
    }
}

TEST(FilledBody, StoresTheEnergyOfTheSolidWhereStrainIsEven) {
    Eigen::Matrix3d F;
    F << 1.1, 0.1, 0, -0.05, 0.9, 0.1, 0.02, 0, 1.2;
    for (const Elements elements : {Elements::linear, Elements::quadratic})
        for (const MaterialLaw law : material_laws) {
            const Askew bar(elements);
            Material material{.young = 1e5, .poisson = 0.3};
            material.law = law;
            const ElasticBody body(bar.tets, material), cube(test::box_mesh({1, 1, 1}, {1, 1, 1}), material);
            const double density = cube.measure(cube.rest().X * F.transpose()).energy;
            EXPECT_NEAR(body.measure(body.rest().X * F.transpose()).energy, density * bar.size.prod(),
                        2e-3 * density * bar.size.prod());
        }
}

/// The forces are those of the energy, the matrix at rest is that of the forces.
TEST(FilledBody, HasForcesAndAMatrixOfItsEnergy) {
    const Askew bar(Elements::quadratic);
    const ElasticBody body(bar.tets, Material{.young = 1, .poisson = 0.3});
    const Nodes& X = body.rest().X;
    const Nodes x = X + test::wild_field(X, 0.02), way = test::wild_field(X, 1).array().sin().matrix();
    ElementPose pose;
    ElementForces parts;
    Nodes forces(X.rows(), 3);
    const auto forces_at = [&](const Nodes& at) {
        body.pose(at, pose, parts);
        body.sum_forces(parts, forces);
        return forces;
    };
    constexpr double h = 1e-6;
    const double slope = (body.measure(x + h * way).energy - body.measure(x - h * way).energy) / (2 * h);
    const Nodes at_x = forces_at(x);
    EXPECT_NEAR(-at_x.cwiseProduct(way).sum(), slope, 1e-6 * std::abs(slope));
    EXPECT_LT(at_x.colwise().sum().norm(), 1e-12);
    const Nodes change = (forces_at(X - h * way) - forces_at(X + h * way)) / (2 * h);
    const Eigen::VectorXd stacked = way.reshaped<Eigen::RowMajor>(),
                          product = body.rest_stiffness() * stacked,
                          expected = change.reshaped<Eigen::RowMajor>();
    EXPECT_LT((product - expected).norm(), 1e-6 * expected.norm());
}

double lowest_frequency(const Body& body) {
    return vibration_modes(ElasticBody(body), {.count = 4}).basis.frequencies[0];
}

/// A cage of twice the volume of a bar vibrates as the bar: 2.5 Hz by Timoshenko is that of fine tetrahedra.
TEST(FilledBody, VibratesInACageAsTheSolidDoes) {
    const Eigen::Vector3d size(1, 0.1, 0.1);
    TriMesh surface = test::box(size[0], size[1], size[2], 1);
    const Eigen::Matrix3d turn =
        Eigen::AngleAxisd(0.3, Eigen::Vector3d(1, 1, 2).normalized()).toRotationMatrix();
    surface.X = (surface.X * turn.transpose()).eval();
    Material material;
    material.poisson = 0.3;
    Body fine;
    fine.tets = make_quadratic(test::box_mesh(size, {20, 2, 2}));
    fine.material = material;
    const double expected = lowest_frequency(fine);
    const CageBody few = make_cage_body("bar", surface, 50, material, Elements::quadratic),
                   more = make_cage_body("bar", surface, 200, material, Elements::quadratic);
    EXPECT_GT(few.report.volume, 1.8 * few.report.material);
    EXPECT_EQ(few.report.why_wrapped, "");
    EXPECT_NEAR(few.report.material, size.prod(), 2e-3 * size.prod());
    EXPECT_NEAR(lowest_frequency(few.body) / expected, 1, 0.01);
    EXPECT_NEAR(lowest_frequency(more.body) / expected, 1, 0.0025);
}

/// A plate of 1:100 in a cage of ten times its thickness.
TEST(FilledBody, OfAThinPlateBendsAsThePlate) {
    const Eigen::Vector3d size(1, 1, 0.01);
    Material material;
    material.poisson = 0.3;
    const CageBody caged =
        make_cage_body("plate", test::box(size[0], size[1], size[2], 1), 200, material, Elements::quadratic);
    EXPECT_GT(caged.report.volume, 5 * size.prod());
    // The free square plate [Leissa69]: 13.489 / L^2 sqrt(D / (rho t)).
    const double D = material.young * std::pow(size[2], 3) / (12 * (1 - 0.09)),
                 expected = 13.489 * std::sqrt(D / (material.density * size[2])) / (2 * M_PI);
    const double got = lowest_frequency(caged.body);
    EXPECT_GT(got, 0.99 * expected);
    EXPECT_LT(got, 1.05 * expected);
}

}  // namespace
}  // namespace nbd
