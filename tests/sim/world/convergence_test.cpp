// Errors against known solutions must fall at the theoretical order.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <vector>

#include "tests/sim/support/one_body_world.hpp"
#include "tests/support/box_mesh.hpp"

namespace nbd {
namespace {

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
                    .centre = {0, 0.2, 0.2},
                    .translation = {0.01, 0, 0.02},
                    .rotation = {0.2, 0.1, 0},
                    .duration = moving_time};
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
