#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <vector>

#include "sim/fem/modes.hpp"
#include "tests/sim/support/one_body_world.hpp"
#include "tests/support/box_mesh.hpp"

namespace nbd {
namespace {

// Compares beams with theory; the error must fall as the mesh is refined.

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
    const ElasticBody body(tets, elastic, {half});
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
        for (const int node : nodes_at(x)) sum += u(node, 0) / nodes_at(x).size();
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
BarFrequencies free_bar(double L, double t, double width, int refinement) {
    const ElasticBody body(test::box_mesh({L, t, width}, Eigen::Vector3i(16, 2, 3) * refinement), elastic);
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
    const BarFrequencies coarse = free_bar(L, t, width, 1), fine = free_bar(L, t, width, 3);
    const double coarse_error = std::abs(coarse.bending / bending - 1);
    const double fine_error = std::abs(fine.bending / bending - 1);
    EXPECT_GT(coarse_error / fine_error, 5);
    EXPECT_LT(fine_error, 0.07);
    EXPECT_NEAR(fine.stretching / stretching, 1, 0.005);
}

// Errors against known solutions must fall at the theoretical order.

// Least-squares slope of log(error) over log(size).
double observed_order(const std::vector<double>& size, const std::vector<double>& error) {
    const Eigen::Index n = size.size();
    Eigen::ArrayXd x = Eigen::Map<const Eigen::ArrayXd>(size.data(), n).log();
    Eigen::ArrayXd y = Eigen::Map<const Eigen::ArrayXd>(error.data(), n).log();
    x -= x.mean();
    y -= y.mean();
    return (x * y).sum() / x.square().sum();
}

// A smooth displacement field u_i = a_i sin(k_i . X + phi_i) and its body force in a linear elastic solid.
struct KnownSolution {
    double mu, lambda;
    Eigen::Vector3d a{1, -0.8, 0.6}, phi{0.3, 1.1, -0.4};
    Eigen::Matrix3d k =
        (Eigen::Matrix3d() << 1.5, 0.6, -0.3, -0.6, 1.2, 0.9, 0.3, -0.9, 1.8).finished();  // rows

    explicit KnownSolution(const Material& m)
        : mu(m.young / (2 * (1 + m.poisson))),
          lambda(m.young * m.poisson / ((1 + m.poisson) * (1 - 2 * m.poisson))) {}

    Eigen::Vector3d sine(const Eigen::Vector3d& X) const {
        return a.cwiseProduct((k * X + phi).array().sin().matrix());
    }
    Eigen::Vector3d displacement(const Eigen::Vector3d& X) const { return sine(X); }
    Eigen::Matrix3d gradient(const Eigen::Vector3d& X) const {  // du_i / dX_j
        return a.cwiseProduct((k * X + phi).array().cos().matrix()).asDiagonal() * k;
    }
    // -div sigma, N/m3.
    Eigen::Vector3d body_force(const Eigen::Vector3d& X) const {
        const Eigen::Vector3d s = sine(X);
        return mu * k.rowwise().squaredNorm().cwiseProduct(s) +
               (mu + lambda) * k.transpose() * k.diagonal().cwiseProduct(s);
    }
    // sigma : epsilon of a displacement gradient, J/m3 times two.
    double energy_density(const Eigen::Matrix3d& H) const {
        const Eigen::Matrix3d strain = (H + H.transpose()) / 2;
        return 2 * mu * strain.squaredNorm() + lambda * strain.trace() * strain.trace();
    }
};

// Calls f(t, barycentric, weight) at four points of each tetrahedron; exact for quadratic polynomials.
template <class F>
void at_quadrature_points(const ElasticBody& body, F&& f) {
    const double near = 0.5854101966249685, far = 0.1381966011250105;
    for (int t = 0; t < body.element_count(); ++t)
        for (int q = 0; q < 4; ++q) {
            Eigen::Vector4d weights = Eigen::Vector4d::Constant(far);
            weights[q] = near;
            f(t, weights, body.rest_volumes()[t] / 4);
        }
}

struct Errors {
    double l2 = 0, energy = 0;
};

// Boundary values and body force of the known solution on a box of cells x cells x cells.
Errors errors_on_box(int cells) {
    const Material material{.young = 1e5, .poisson = 0.3, .rayleigh_mass = 0, .rayleigh_stiffness = 0};
    const KnownSolution known(material);
    const ElasticBody body(test::box_mesh({1, 1, 1}, Eigen::Vector3i::Constant(cells), 0.2), material);
    const Nodes& X = body.rest().X;
    const auto corners = [&](int t) { return X(body.rest().T.row(t), Eigen::all); };

    Loads loads{.gravity = Eigen::Vector3d::Zero(), .forces = Nodes::Zero(X.rows(), 3)};
    at_quadrature_points(body, [&](int t, const Eigen::Vector4d& b, double weight) {
        const Eigen::Vector3d force = known.body_force(corners(t).transpose() * b);
        for (int c = 0; c < 4; ++c)
            loads.forces.row(body.rest().T(t, c)) += weight * b[c] * force.transpose();
    });
    const auto boundary =
        test::nodes_where(X, [](const auto& p) { return p.minCoeff() < 1e-9 || p.maxCoeff() > 1 - 1e-9; });
    Nodes held(boundary.size(), 3);
    for (Eigen::Index i = 0; i < held.rows(); ++i)
        held.row(i) = known.displacement(X.row(boundary[i])).transpose();
    const Nodes u = test::static_displacements(body, boundary, loads, held);

    Errors errors;
    at_quadrature_points(body, [&](int t, const Eigen::Vector4d& b, double weight) {
        const Eigen::Vector3d p = corners(t).transpose() * b;
        const Eigen::Matrix<double, 4, 3> own = u(body.rest().T.row(t), Eigen::all);
        // The rows of the inverse are the gradients of the barycentric coordinates.
        Eigen::Matrix4d shape;
        shape << corners(t), Eigen::Vector4d::Ones();
        const Eigen::Matrix<double, 3, 4> gradients = shape.inverse().topRows<3>();
        errors.l2 += weight * (known.displacement(p) - own.transpose() * b).squaredNorm();
        errors.energy +=
            weight * known.energy_density(known.gradient(p) - own.transpose() * gradients.transpose());
    });
    return {std::sqrt(errors.l2), std::sqrt(errors.energy)};
}

TEST(Convergence, LinearTetrahedraHaveOrderTwoInDisplacementAndOneInEnergy) {
    std::vector<double> h, l2, energy;
    for (const int cells : {6, 10, 16}) {
        const Errors errors = errors_on_box(cells);
        h.push_back(1.0 / cells);
        l2.push_back(errors.l2);
        energy.push_back(errors.energy);
    }
    EXPECT_LT(l2.back(), 0.002);
    EXPECT_GT(l2.front(), 0.005);
    EXPECT_NEAR(observed_order(h, l2), 2, 0.15);
    EXPECT_NEAR(observed_order(h, energy), 1, 0.1);
}

const Material damped{.young = 1e5, .poisson = 0.3, .rayleigh_mass = 0.5, .rayleigh_stiffness = 2e-3};

const double moving_time = 0.05;  // seconds

// Where a swinging body is while one of its ends is moved.
Nodes moved_at_one_end(const ElasticBody& body, int steps) {
    const Nodes& X = body.rest().X;
    BodyState start{X, 0.5 * test::wild_field(X, 1)};
    const Grip grip{.nodes = test::nodes_where(X, [](const auto& p) { return p[0] == 0; }),
                    .motion = eased({.centre = {0, 0.2, 0.2},
                                     .translation = {0.01, 0, 0.02},
                                     .rotation = {0.2, 0.1, 0},
                                     .duration = moving_time})};
    for (const int node : grip.nodes) start.v.row(node).setZero();
    WorldConfig config = test::exact_steps(60, 1e-8);
    config.linear.solver = LinearSolver::iterative;
    config.gravity = {0, 0, -9.81};
    test::OneBodyWorld world(body, config, start, {grip});
    world.steps(steps, moving_time / steps);
    return world.state().x;
}

TEST(Convergence, BackwardEulerHasOrderOneInTheTimeStep) {
    const ElasticBody body(test::box_mesh({1, 0.4, 0.4}, {4, 2, 2}, 0.2), damped);
    const int finest = 320;
    // Two fine runs with the error of first order taken out.
    const Nodes reference = 2 * moved_at_one_end(body, 2 * finest) - moved_at_one_end(body, finest);
    ASSERT_GT((reference - body.rest().X).rowwise().norm().maxCoeff(), 0.05);
    std::vector<double> dt, error;
    for (const int steps : {20, 40, 80, 160}) {
        dt.push_back(moving_time / steps);
        error.push_back((moved_at_one_end(body, steps) - reference).norm());
    }
    EXPECT_GT(error.back(), 1e-6);
    EXPECT_NEAR(observed_order(dt, error), 1, 0.15);
}

}  // namespace
}  // namespace nbd
