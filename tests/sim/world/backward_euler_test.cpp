#include "sim/fem/backward_euler.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <stdexcept>

#include "tests/support/box_mesh.hpp"
#include "tests/support/on_threads.hpp"

namespace nbd {
namespace {

const Material undamped{
    .young = 1e5, .poisson = 0.3, .density = 1000, .rayleigh_mass = 0, .rayleigh_stiffness = 0};

BodyState at_rest(const ElasticBody& body) { return {body.rest().X, Nodes::Zero(body.node_count(), 3)}; }

// A state that spins, stretches and vibrates at once.
BodyState violent(const ElasticBody& body, double strength = 1) {
    BodyState state = at_rest(body);
    const Nodes& X = body.rest().X;
    for (Eigen::Index i = 0; i < X.rows(); ++i) {
        const Eigen::Vector3d arm = (X.row(i) - X.colwise().mean()).transpose();
        state.v.row(i) =
            (Eigen::Vector3d(3, -9, 6).cross(arm) + Eigen::Vector3d(8, -5, 2).cwiseProduct(arm)).transpose();
    }
    state.v += test::wild_field(X, 0.8);
    state.v *= strength;
    return state;
}

double total_energy(const ElasticBody& body, const BodyState& state) {
    ElementPose pose;
    body.pose(state.x, pose);
    return body.energy(pose) + kinetic_energy(body, state.v);
}

TEST(BackwardEuler, AFreelyFallingBodyKeepsItsShape) {
    const ElasticBody body(test::box_mesh({1, 0.5, 0.5}, {4, 2, 2}, 0.2), undamped);
    StepSystem system(body);
    BodyState state = at_rest(body);
    const Loads loads{.gravity = {0.5, 0, -9.81}, .forces = {}};
    const double dt = 0.01;
    const int steps = 50;
    for (int s = 0; s < steps; ++s) backward_euler_step(system, state, dt, loads);
    const Eigen::RowVector3d fall = loads.gravity.transpose() * dt * dt * steps * (steps + 1) / 2;
    EXPECT_LT((state.x - (body.rest().X.rowwise() + fall)).cwiseAbs().maxCoeff(), 1e-12);
    EXPECT_LT((state.v.rowwise() - loads.gravity.transpose() * dt * steps).cwiseAbs().maxCoeff(), 1e-11);
}

TEST(BackwardEuler, MassDampingSlowsADriftingBody) {
    Material damped = undamped;
    damped.rayleigh_mass = 2;
    const ElasticBody body(test::box_mesh({1, 0.5, 0.5}, {2, 1, 1}), damped);
    StepSystem system(body);
    BodyState state = at_rest(body);
    state.v.col(0).setConstant(3);
    backward_euler_step(system, state, 0.1);
    EXPECT_LT((state.v.col(0).array() - 3 / 1.2).abs().maxCoeff(), 1e-13);
}

TEST(BackwardEuler, ConservesLinearMomentumToRounding) {
    for (const MassKind mass : {MassKind::lumped, MassKind::consistent}) {
        Material material = undamped;
        material.rayleigh_stiffness = 1e-3;
        const ElasticBody body(test::box_mesh({1, 0.5, 0.5}, {5, 3, 3}, 0.2), material, mass);
        StepSystem system(body);
        BodyState state = violent(body);
        const Eigen::Vector3d before = linear_momentum(body, state.v);
        ASSERT_GT(before.norm(), 1);
        for (int s = 0; s < 100; ++s) backward_euler_step(system, state, 0.01);
        EXPECT_LT((linear_momentum(body, state.v) - before).norm(), 1e-11 * before.norm());
    }
}

// One step changes angular momentum by dt^2 sum v x f, so the drift over a given time falls with dt.
TEST(BackwardEuler, ConservesAngularMomentumToFirstOrder) {
    const ElasticBody body(test::box_mesh({1, 0.5, 0.5}, {4, 2, 2}, 0.2), undamped);
    StepSystem system(body);
    double drift[3];
    for (int refinement = 0; refinement < 3; ++refinement) {
        BodyState state = violent(body, 0.3);
        const Eigen::Vector3d before = angular_momentum(body, state.x, state.v);
        const int steps = 40 << refinement;
        for (int s = 0; s < steps; ++s) backward_euler_step(system, state, 0.1 / steps, {}, {}, 20, 1e-12);
        drift[refinement] = (angular_momentum(body, state.x, state.v) - before).norm() / before.norm();
    }
    EXPECT_LT(drift[0], 0.2);
    EXPECT_GT(drift[2], 1e-9);
    EXPECT_NEAR(drift[0] / drift[1], 2, 0.3);
    EXPECT_NEAR(drift[1] / drift[2], 2, 0.3);
}

TEST(BackwardEuler, EnergyNeverGrowsWithoutExternalForces) {
    const ElasticBody body(test::box_mesh({1, 0.5, 0.5}, {5, 3, 3}, 0.2), undamped);
    StepSystem system(body);
    for (const int iterations : {1, 3}) {
        BodyState state = violent(body);
        const double first = total_energy(body, state);
        double energy = first, largest_strain_energy = 0;
        for (int s = 0; s < 300; ++s) {
            backward_euler_step(system, state, 0.005, {}, {}, iterations);
            const double next = total_energy(body, state);
            ASSERT_LE(next, energy * (1 + 1e-12)) << "step " << s << ", " << iterations << " iterations";
            largest_strain_energy = std::max(largest_strain_energy, next - kinetic_energy(body, state.v));
            energy = next;
        }
        EXPECT_GT(largest_strain_energy, 0.1 * first);
        EXPECT_LT(energy, 0.9 * first);
        EXPECT_GT(energy, 0.05 * first);
    }
}

TEST(BackwardEuler, NewtonIterationsReduceTheResidual) {
    const ElasticBody body(test::box_mesh({1, 0.5, 0.5}, {4, 2, 2}, 0.2), undamped);
    StepSystem system(body);
    double last = 1;
    for (const int iterations : {1, 2, 4, 8}) {
        BodyState state = violent(body);
        const StepReport report = backward_euler_step(system, state, 0.01, {}, {}, iterations, 0);
        EXPECT_EQ(report.newton_iterations, iterations);
        EXPECT_LT(report.residual, 0.5 * last);
        last = report.residual;
    }
    EXPECT_LT(last, 1e-6);
    BodyState state = violent(body);
    const StepReport report = backward_euler_step(system, state, 0.01, {}, {}, 50, 1e-9);
    EXPECT_LT(report.newton_iterations, 50);
    EXPECT_LE(report.residual, 1e-9);
}

TEST(BackwardEuler, PrescribedNodesMoveExactlyAsPrescribed) {
    const ElasticBody body(test::box_mesh({1, 0.5, 0.5}, {4, 2, 2}), undamped);
    StepSystem system(body);
    BodyState state = at_rest(body);
    const auto left = test::nodes_where(body.rest().X, [](const auto& p) { return p[0] == 0; });
    const auto right = test::nodes_where(body.rest().X, [](const auto& p) { return p[0] == 1; });
    PrescribedNodes grips;
    grips.nodes = left;
    grips.nodes.insert(grips.nodes.end(), right.begin(), right.end());
    grips.v = Nodes::Zero(left.size() + right.size(), 3);
    grips.v.bottomRows(right.size()).col(0).setConstant(0.4);
    for (int s = 0; s < 10; ++s) backward_euler_step(system, state, 0.05, {}, grips);
    for (int node : left) EXPECT_EQ(state.x.row(node), body.rest().X.row(node));
    for (int node : right) EXPECT_NEAR(state.x(node, 0), 1.2, 1e-15);
}

// An affine motion of the boundary must move interior nodes affinely and strain all elements equally.
TEST(BackwardEuler, PassesThePatchTest) {
    const ElasticBody body(test::box_mesh({1, 0.7, 0.8}, {4, 4, 3}, 0.3), undamped);
    StepSystem system(body);
    Eigen::Matrix3d A;
    A << 1.2, 0.1, -0.05, 0, 0.85, 0.2, 0.1, -0.1, 1.1;
    A = Eigen::AngleAxisd(0.4, Eigen::Vector3d(1, 1, 0).normalized()) * A;
    const Nodes& X = body.rest().X;
    const Nodes target = X * A.transpose();
    const auto on_boundary = [](const Eigen::Vector3d& p) {
        return p.minCoeff() < 1e-9 || p[0] > 1 - 1e-9 || p[1] > 0.7 - 1e-9 || p[2] > 0.8 - 1e-9;
    };
    PrescribedNodes boundary;
    boundary.nodes = test::nodes_where(X, on_boundary);
    ASSERT_GE(body.node_count() - static_cast<int>(boundary.nodes.size()), 18);
    const double dt = 1e4;  // large enough for inertia to vanish: static equilibrium
    boundary.v.resize(boundary.nodes.size(), 3);
    for (std::size_t k = 0; k < boundary.nodes.size(); ++k)
        boundary.v.row(k) = (target.row(boundary.nodes[k]) - X.row(boundary.nodes[k])) / dt;
    BodyState state = at_rest(body);
    const StepReport report = backward_euler_step(system, state, dt, {}, boundary, 100, 1e-13);
    EXPECT_TRUE(report.elements.ok());
    EXPECT_LT((state.x - target).cwiseAbs().maxCoeff(), 1e-9);
    ElementPose pose;
    body.pose(state.x, pose);
    for (const auto& F : pose.F) EXPECT_LT((F - A).norm(), 1e-8);
    Nodes f(X.rows(), 3);
    body.forces(pose, f);
    for (int i : test::nodes_where(X, [&](const auto& p) { return !on_boundary(p); }))
        EXPECT_LT(f.row(i).norm(), 1e-7 * f.norm());
}

TEST(BackwardEuler, GivesTheSameBitsOnAnyNumberOfThreads) {
    const ElasticBody body(test::box_mesh({1, 0.5, 0.5}, {12, 8, 8}, 0.2), undamped);
    const auto run = [&] {
        BodyState state = violent(body);
        StepSystem system(body);
        for (int s = 0; s < 3; ++s) backward_euler_step(system, state, 0.01);
        return state;
    };
    const BodyState one = test::on_threads(1, run), four = test::on_threads(4, run);
    EXPECT_TRUE(one.x == four.x);
    EXPECT_TRUE(one.v == four.v);
}

TEST(BackwardEuler, LeavesTheStateUnchangedWhenAStepFails) {
    const ElasticBody body(test::box_mesh({1, 0.5, 0.5}, {2, 1, 1}), undamped);
    StepSystem system(body);
    BodyState state = violent(body);
    state.x(3, 1) = std::nan("");
    const Nodes v = state.v;
    EXPECT_THROW(backward_euler_step(system, state, 0.01), std::runtime_error);
    EXPECT_EQ(state.v, v);
    EXPECT_THROW(backward_euler_step(system, state, 0.01, {}, {}, 0), std::invalid_argument);
}

}  // namespace
}  // namespace nbd
