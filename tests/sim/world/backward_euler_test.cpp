// Steps of a lone body against what is known of backward Euler.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <stdexcept>
#include <string>

#include "sim/fem/momentum.hpp"
#include "tests/sim/support/momentum.hpp"
#include "tests/sim/support/one_body_world.hpp"
#include "tests/support/box_mesh.hpp"
#include "tests/support/error_of.hpp"
#include "tests/support/on_threads.hpp"

namespace nbd {
namespace {

using test::exact_steps;
using test::OneBodyWorld;

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
    return body.measure(state.x).energy + kinetic_energy(body, state.v);
}

TEST(BackwardEuler, AFreelyFallingBodyKeepsItsShape) {
    const ElasticBody body(test::box_mesh({1, 0.5, 0.5}, {4, 2, 2}, 0.2), undamped);
    WorldConfig config = exact_steps();
    config.gravity = {0.5, 0, -9.81};
    OneBodyWorld world(body, config);
    const double dt = 0.01;
    const int steps = 50;
    world.steps(steps, dt);
    const Eigen::RowVector3d g = config.gravity.transpose(), fall = g * dt * dt * steps * (steps + 1) / 2;
    EXPECT_LT((world.state().x - (body.rest().X.rowwise() + fall)).cwiseAbs().maxCoeff(), 1e-12);
    EXPECT_LT((world.state().v.rowwise() - g * dt * steps).cwiseAbs().maxCoeff(), 1e-11);
}

TEST(BackwardEuler, MassDampingSlowsADriftingBody) {
    Material damped = undamped;
    damped.rayleigh_mass = 2;
    const ElasticBody body(test::box_mesh({1, 0.5, 0.5}, {2, 1, 1}), damped);
    BodyState start = at_rest(body);
    start.v.col(0).setConstant(3);
    OneBodyWorld world(body, exact_steps(), start);
    world.step(0.1);
    EXPECT_LT((world.state().v.col(0).array() - 3 / 1.2).abs().maxCoeff(), 1e-13);
}

class BackwardEulerOfEveryLaw : public ::testing::TestWithParam<MaterialLaw> {
 protected:
    static Material material() {
        Material material = undamped;
        material.law = GetParam();
        return material;
    }
};

INSTANTIATE_TEST_SUITE_P(Laws, BackwardEulerOfEveryLaw, ::testing::ValuesIn(material_laws),
                         [](const auto& test) { return std::string(name(test.param)); });

TEST_P(BackwardEulerOfEveryLaw, LinearMomentumIsKeptToRounding) {
    for (const LinearSolver solver : {LinearSolver::direct, LinearSolver::iterative}) {
        Material damped = material();
        damped.rayleigh_stiffness = 1e-3;
        const ElasticBody body(test::box_mesh({1, 0.5, 0.5}, {5, 3, 3}, 0.2), damped);
        WorldConfig config = exact_steps();
        config.linear.solver = solver;
        OneBodyWorld world(body, config, violent(body, 0.5));
        const Eigen::Vector3d before = test::linear_momentum(body, world.state().v);
        ASSERT_GT(before.norm(), 1);
        world.steps(50, 0.005);
        // Conjugate gradients leave up to their tolerance in every step.
        const double rounding = solver == LinearSolver::direct ? 1e-11 : 100 * config.linear.tolerance;
        EXPECT_LT((test::linear_momentum(body, world.state().v) - before).norm(), rounding * before.norm());
    }
}

// The forces that a solved step of backward Euler applies are those of its end, where they have no torque.
TEST_P(BackwardEulerOfEveryLaw, ForcesOfAStepHaveNoTorqueAtItsEnd) {
    const ElasticBody body(test::box_mesh({1, 0.5, 0.5}, {4, 2, 2}, 0.2), material());
    OneBodyWorld world(body, exact_steps(60, 1e-12), violent(body, 0.3));
    for (int s = 0; s < 20; ++s) {
        const BodyState before = world.state();
        world.step(0.0025);
        const Nodes v = (world.state().x - before.x) / 0.0025;  // those of the state are turned
        const Nodes impulse = body.node_masses().asDiagonal() * (v - before.v);
        Eigen::Vector3d torque = Eigen::Vector3d::Zero();
        double size = 0;
        for (Eigen::Index i = 0; i < impulse.rows(); ++i) {
            const Eigen::Vector3d x = world.state().x.row(i), p = impulse.row(i);
            torque += x.cross(p);
            size += x.norm() * p.norm();
        }
        ASSERT_GT(size, 1e-3);
        EXPECT_LT(torque.norm(), 1e-8 * size) << "step " << s;
    }
}

// One linearisation a step, by the iterative solver.
TEST(BackwardEuler, AStepOfOneLinearisationConvergesToFirstOrder) {
    const ElasticBody body(test::box_mesh({1, 0.5, 0.5}, {4, 2, 2}, 0.2), undamped);
    const BodyState start = violent(body, 0.3);
    const auto after = [&](const WorldConfig& config, int steps) {
        OneBodyWorld world(body, config, start);
        world.steps(steps, 0.05 / steps);
        return Nodes(world.state().x);
    };
    const WorldConfig shipped{.gravity = Eigen::Vector3d::Zero(),
                              .step = {.integrator = TimeIntegrator::backward_euler}};
    const Nodes truth = after(exact_steps(60, 1e-12), 2560);
    double error[3];
    for (int refinement = 0; refinement < 3; ++refinement)
        error[refinement] = (after(shipped, 40 << refinement) - truth).norm();
    EXPECT_LT(error[2], 0.05 * (truth - start.x).norm());
    EXPECT_NEAR(error[0] / error[1], 2, 0.3);
    EXPECT_NEAR(error[1] / error[2], 2, 0.3);
}

TEST_P(BackwardEulerOfEveryLaw, EnergyNeverGrowsWithoutExternalForces) {
    const ElasticBody body(test::box_mesh({1, 0.5, 0.5}, {5, 3, 3}, 0.2), material());
    for (const int iterations : {1, 3}) {
        OneBodyWorld world(body, exact_steps(iterations), violent(body));
        const double first = total_energy(body, world.state());
        double energy = first, largest_strain_energy = 0;
        for (int s = 0; s < 300; ++s) {
            ASSERT_EQ(world.world().step(0.005).failure, "");
            const double next = total_energy(body, world.state());
            // Keeping the angular momentum gives back what a step takes from the rotation.
            ASSERT_LE(next, energy * (1 + 1e-3)) << "step " << s << ", " << iterations << " iterations";
            ASSERT_LE(next, first);
            largest_strain_energy =
                std::max(largest_strain_energy, next - kinetic_energy(body, world.state().v));
            energy = next;
        }
        EXPECT_GT(largest_strain_energy, 0.1 * first);
        EXPECT_LT(energy, 0.9 * first);
        EXPECT_GT(energy, 0.05 * first);
    }
}

TEST_P(BackwardEulerOfEveryLaw, NewtonIterationsReduceTheResidual) {
    const ElasticBody body(test::box_mesh({1, 0.5, 0.5}, {4, 2, 2}, 0.2), material());
    const BodyState start = violent(body);
    constexpr double rounding = 1e-8;  // of the relative residual
    double last = 1;
    for (const int iterations : {1, 2, 4, 8}) {
        OneBodyWorld world(body, exact_steps(iterations, 1e-12), start);
        EXPECT_LE(world.world().step(0.01).newton_iterations, iterations);
        const double residual = test::step_residual(body, start, world.state(), 0.01);
        EXPECT_LT(residual, std::max(0.5 * last, rounding));
        last = residual;
    }
    EXPECT_LT(last, rounding);
    OneBodyWorld world(body, exact_steps(50, 1e-9), start);
    const WorldReport report = world.world().step(0.01);
    EXPECT_EQ(report.rejection, "");
    EXPECT_LT(report.newton_iterations, 50);
    EXPECT_LE(test::step_residual(body, start, world.state(), 0.01), 1e-9);
}

TEST(BackwardEuler, GrippedNodesMoveExactlyAsTold) {
    const ElasticBody body(test::box_mesh({1, 0.5, 0.5}, {4, 2, 2}), undamped);
    const Nodes& X = body.rest().X;
    const Grip left{.nodes = test::nodes_where(X, [](const auto& p) { return p[0] == 0; })};
    const Grip right{.nodes = test::nodes_where(X, [](const auto& p) { return p[0] == 1; }),
                     .motion = eased({.translation = {0.2, 0, 0}, .duration = 0.5})};
    OneBodyWorld world(body, exact_steps(), {}, {left, right});
    for (int s = 0; s < 10; ++s) {
        world.step(0.05);
        for (int node : left.nodes) EXPECT_EQ(world.state().x.row(node), X.row(node));
        for (int node : right.nodes)
            EXPECT_LT(
                (world.state().x.row(node).transpose() - right.motion.at(world.world().time())(X.row(node)))
                    .norm(),
                1e-15);
    }
    EXPECT_NEAR(world.state().x(right.nodes.front(), 0), 1.2, 1e-15);
}

// Gravity, outer forces, damping, grips and the linear solve, all in one, under a large rigid motion x -> Q x
// + b.
TEST(BackwardEuler, AStepTurnsAlongWithALargeRigidMotion) {
    const Eigen::Matrix3d Q =
        Eigen::AngleAxisd(2.9, Eigen::Vector3d(2, -1, 3).normalized()).toRotationMatrix();
    const Eigen::RowVector3d b{700, -900, 400};  // metres; the body is 1 m long
    const auto turned = [&](const Nodes& v) -> Nodes { return v * Q.transpose(); };
    const auto moved = [&](const Nodes& x) -> Nodes { return turned(x).rowwise() + b; };
    const ElasticBody body{
        test::box_mesh({1, 0.6, 0.8}, {4, 3, 3}, 0.2),
        Material{.young = 2e5, .poisson = 0.3, .rayleigh_mass = 0.4, .rayleigh_stiffness = 1e-3}};
    const Nodes X = body.rest().X, x = X + test::wild_field(X, 0.08);  // some elements inverted
    const Nodes v = test::wild_field(X, 2).rowwise() + Eigen::RowVector3d(3, 1, -2);
    const Nodes forces = test::wild_field(X, 0.5);
    const Move move{.centre = {0.1, 0.2, 0.3},
                    .translation = {0.02, -0.01, 0.03},
                    .rotation = {0.1, 0.3, -0.2},
                    .duration = 0.02};
    const Grip grip{.nodes = test::nodes_where(X, [](const auto& p) { return p[0] == 0; }),
                    .motion = eased(move)};
    Grip turned_grip = grip;
    turned_grip.motion = eased({.centre = Q * move.centre + b.transpose(),
                                .translation = Q * move.translation,
                                .rotation = Q * move.rotation,
                                .duration = move.duration});
    // Two iterations do not reach the tolerance, but both worlds must get equally far.
    WorldConfig config = exact_steps(2), turned_config = config;
    config.gravity = {1, -3, -9};
    turned_config.gravity = Q * config.gravity;
    OneBodyWorld here(body, config, {x, v}, {grip});
    OneBodyWorld there(body, turned_config, {moved(x), turned(v)}, {turned_grip});
    here.world().forces(0) = forces;
    there.world().forces(0) = turned(forces);
    for (int s = 0; s < 3; ++s)
        for (OneBodyWorld* world : {&here, &there}) {
            const WorldReport report = world->world().step(0.005);
            EXPECT_EQ(report.failure, "");
            EXPECT_EQ(report.newton_iterations, 2);
        }
    const BodyState &end = here.state(), &turned_end = there.state();
    ASSERT_GT((end.x - x).norm(), 0.1);
    EXPECT_LT((turned_end.v - turned(end.v)).norm(), 1e-8 * end.v.norm());
    EXPECT_LT((turned_end.x - moved(end.x)).norm(), 1e-8 * (end.x - x).norm());
}

// An affine motion of the boundary must move interior nodes affinely and strain all elements equally.
TEST(BackwardEuler, PassesThePatchTest) {
    const ElasticBody body(test::box_mesh({1, 0.7, 0.8}, {4, 4, 3}, 0.3), undamped);
    Eigen::Matrix3d A;
    A << 1.2, 0.1, -0.05, 0, 0.85, 0.2, 0.1, -0.1, 1.1;
    A = Eigen::AngleAxisd(0.4, Eigen::Vector3d(1, 1, 0).normalized()) * A;
    const Nodes& X = body.rest().X;
    const Nodes target = X * A.transpose();
    const auto on_boundary = [](const Eigen::Vector3d& p) {
        return p.minCoeff() < 1e-9 || p[0] > 1 - 1e-9 || p[1] > 0.7 - 1e-9 || p[2] > 0.8 - 1e-9;
    };
    const auto inside = test::nodes_where(X, [&](const auto& p) { return !on_boundary(p); });
    ASSERT_GE(inside.size(), 18u);
    std::vector<Grip> grips;
    for (const int node : test::nodes_where(X, on_boundary))
        grips.push_back({.nodes = {node}, .motion = eased({.translation = target.row(node) - X.row(node)})});
    OneBodyWorld world(body, exact_steps(100, 1e-12), {}, grips);
    world.step(1e4);  // so long that inertia vanishes: the static equilibrium
    EXPECT_LT((world.state().x - target).cwiseAbs().maxCoeff(), 1e-9);
    ElementPose pose;
    ElementForces forces;
    body.pose(world.state().x, pose, forces);
    EXPECT_TRUE(body.measure(world.state().x).ok());
    for (int t = 0; t < body.element_count(); ++t)
        EXPECT_LT((body.deformation_gradient(world.state().x, t) - A).norm(), 1e-8);
    Nodes f(X.rows(), 3);
    body.sum_forces(forces, f);
    for (const int i : inside) EXPECT_LT(f.row(i).norm(), 1e-7 * f.norm());
}

TEST(BackwardEuler, GivesTheSameBitsOnAnyNumberOfThreads) {
    const ElasticBody body(test::box_mesh({1, 0.5, 0.5}, {12, 8, 8}, 0.2), undamped);
    for (const LinearSolver solver : {LinearSolver::direct, LinearSolver::iterative}) {
        const auto run = [&] {
            WorldConfig config = exact_steps();
            config.linear.solver = solver;
            OneBodyWorld world(body, config, violent(body));
            world.steps(3, 0.01);
            return world.state();
        };
        const BodyState one = test::on_threads(1, run), four = test::on_threads(4, run);
        EXPECT_TRUE(one.x == four.x);
        EXPECT_TRUE(one.v == four.v);
    }
}

TEST(BackwardEuler, LeavesTheStateUnchangedWhenAStepFails) {
    const ElasticBody body(test::box_mesh({1, 0.5, 0.5}, {2, 1, 1}), undamped);
    const BodyState start = violent(body);
    OneBodyWorld world(body, exact_steps(), start);
    world.world().forces(0)(3, 1) = std::nan("");
    EXPECT_NE(world.world().step(0.01).failure, "");
    EXPECT_EQ(world.state().x, start.x);
    EXPECT_EQ(world.state().v, start.v);
    EXPECT_EQ(
        test::refusal([&] { OneBodyWorld(body, exact_steps(0)); }),
        "world: steps need newton_iterations >= 1, newton_tolerance > 0 and max_substeps a power of two");
}

}  // namespace
}  // namespace nbd
