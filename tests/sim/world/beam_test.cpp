// Compares beams with theory; the error must fall as the mesh is refined.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "sim/fem/modes.hpp"
#include "tests/sim/support/one_body_world.hpp"
#include "tests/support/box_mesh.hpp"

namespace nbd {
namespace {

const Material elastic{
    .young = 1e6, .poisson = 0, .density = 1000, .rayleigh_mass = 0, .rayleigh_stiffness = 0};

// Tip deflection of a clamped beam under a small weight, divided by Timoshenko's q L^4 / (8 E I) + q L^2 / (2
// kappa G A), kappa = 5/6.
double relative_sag(int refinement, MaterialLaw law = MaterialLaw::corotated) {
    const double L = 1, h = 0.25, g = 1e-3;
    Material material = elastic;
    material.law = law;
    const ElasticBody body(test::box_mesh({L, h, h}, Eigen::Vector3i(8, 2, 2) * refinement), material);
    const auto clamped = test::nodes_where(body.rest().X, [](const auto& p) { return p[0] == 0; });
    const Nodes u = test::static_displacements(body, clamped, {.gravity = {0, 0, -g}, .forces = {}});
    double tip = 0;
    const auto end = test::nodes_where(body.rest().X, [&](const auto& p) { return p[0] == L; });
    for (int node : end) tip -= u(node, 2) / end.size();
    const double q = elastic.density * g * h * h, EI = elastic.young * std::pow(h, 4) / 12;
    const double GA = 0.5 * elastic.young * h * h;
    return tip / (q * std::pow(L, 4) / (8 * EI) + q * L * L / (2 * 5.0 / 6 * GA));
}

TEST(Beam, CantileverDeflectionConvergesToTimoshenkoTheory) {
    const double coarse = 1 - relative_sag(1), medium = 1 - relative_sag(2), fine = 1 - relative_sag(4);
    EXPECT_GT(coarse, 0);  // linear elements are too stiff
    EXPECT_GT(coarse / medium, 2);
    EXPECT_GT(medium / fine, 3);
    EXPECT_LT(fine, 0.06);
}

TEST(Beam, EveryLawHasTheSameSmallDeflections) {
    const double expected = relative_sag(1);
    for (const MaterialLaw law : {MaterialLaw::stable_neo_hookean, MaterialLaw::st_venant_kirchhoff})
        EXPECT_NEAR(relative_sag(1, law), expected, 1e-9 * expected) << name(law);
}

/// Two halves of a bar that is pulled stretch in inverse proportion to their stiffness.
TEST(Beam, HalvesOfTwoMaterialsStretchByTheirStiffness) {
    const double L = 1, h = 0.25, force = 1e-2;
    const TetMesh tets = test::box_mesh({L, h, h}, {8, 2, 2});
    MaterialRegion half{.name = "half", .material = elastic, .tets = {}};
    half.material.young = 10 * elastic.young;
    for (int t = 0; t < tets.T.rows(); ++t)
        if (test::centre(tets, t)[0] > L / 2) half.tets.push_back(t);
    const ElasticBody body(tets, elastic, MassKind::lumped, {half});
    const auto nodes_at = [&](double x) {
        return test::nodes_where(body.rest().X, [&](const auto& p) { return std::abs(p[0] - x) < 1e-9; });
    };
    Nodes pull = Nodes::Zero(body.node_count(), 3);
    // Each node of the end carries its share of the face: that of the area of the triangles around it.
    const Faces boundary = boundary_faces(tets);
    for (Eigen::Index f = 0; f < boundary.rows(); ++f) {
        const Eigen::RowVector3d a = tets.X.row(boundary(f, 0)), b = tets.X.row(boundary(f, 1)),
                                 c = tets.X.row(boundary(f, 2));
        if (std::min({a[0], b[0], c[0]}) < L - 1e-9) continue;
        const double share = 0.5 * (b - a).cross(c - a).norm() / (h * h) / 3;
        for (int k = 0; k < 3; ++k) pull(boundary(f, k), 0) += share * force;
    }
    const Nodes u = test::static_displacements(body, nodes_at(0), {.gravity = {0, 0, 0}, .forces = pull});
    const auto mean = [&](double x) {
        double sum = 0;
        for (const int node : nodes_at(x)) sum += u(node, 0) / static_cast<double>(nodes_at(x).size());
        return sum;
    };
    const double soft = force * L / 2 / (elastic.young * h * h);
    EXPECT_NEAR(mean(L / 2), soft, 1e-6 * soft);
    EXPECT_NEAR(mean(L) - mean(L / 2), soft / 10, 1e-6 * soft);
}

struct BarFrequencies {
    double bending, stretching;
};

// A free bar with a rectangular section, thickness t < width.
BarFrequencies free_bar(double L, double t, double width, int refinement, MassKind mass) {
    const ElasticBody body(test::box_mesh({L, t, width}, Eigen::Vector3i(16, 2, 3) * refinement), elastic,
                           mass);
    const Modes modes = vibration_modes(body, {.count = 8});
    // The lowest mode bends about the weak axis; the longitudinal mode moves along x only.
    BarFrequencies found{modes.basis.frequencies[0], 0};
    for (int c = 0; c < 8; ++c) {
        double along = 0, across = 0;
        for (int i = 0; i < body.node_count(); ++i) {
            along += std::pow(modes.basis.U(3 * i, c), 2);
            across += modes.basis.U.block<2, 1>(3 * i + 1, c).squaredNorm();
        }
        if (along > 10 * across && found.stretching == 0) found.stretching = modes.basis.frequencies[c];
    }
    return found;
}

TEST(Beam, FreeBarFrequenciesConvergeToBeamTheory) {
    const double L = 1, t = 0.1, width = 0.17;
    // Bending with shear and rotary inertia as in ASTM E1876, for Poisson's ratio 0 and density 1000.
    const double r = t / L, r2 = r * r, r4 = r2 * r2;
    const double correction = 1 + 6.585 * r2 - 0.868 * r4 - 8.340 * r4 / (1 + 6.338 * r2);
    const double mass = elastic.density * L * t * width;
    const double bending =
        std::sqrt(elastic.young * width / (0.9465 * mass * correction) * std::pow(t / L, 3));
    const double stretching = std::sqrt(elastic.young / elastic.density) / (2 * L);
    for (const MassKind kind : {MassKind::lumped, MassKind::consistent}) {
        const BarFrequencies coarse = free_bar(L, t, width, 1, kind), fine = free_bar(L, t, width, 3, kind);
        const double coarse_error = std::abs(coarse.bending / bending - 1);
        const double fine_error = std::abs(fine.bending / bending - 1);
        EXPECT_GT(coarse_error / fine_error, 5);
        EXPECT_LT(fine_error, 0.07);
        EXPECT_NEAR(fine.stretching / stretching, 1, 0.005);
    }
}

}  // namespace
}  // namespace nbd
