#include "sim/solvers/coupled_solver.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "tests/support/box_body.hpp"
#include "tests/support/box_mesh.hpp"
#include "tests/support/on_threads.hpp"

namespace nbd {
namespace {

constexpr double dt = 0.01;

/// Two twisted and bent bars, one fixed at an end, coupled at some nodes.
struct Scene {
    ElasticBody body{test::box_mesh({2, 0.4, 0.4}, {24, 5, 5}), {.young = 1e5}};
    std::vector<StepSystem> systems;
    std::vector<int> first_unknown{0};
    std::vector<CouplingTerm> terms;
    std::vector<Coupling> couplings;
    Eigen::VectorXd b;

    explicit Scene(double turns, double stiffness = 0) {
        systems.emplace_back(body);
        systems.emplace_back(body);
        for (int i = 0; i < 2; ++i) {
            BodyState state{body.rest().X, Nodes::Zero(body.node_count(), 3)};
            for (Eigen::Index k = 0; k < state.x.rows(); ++k) {
                const Eigen::Vector3d X = state.x.row(k);
                const Eigen::Matrix3d R = (Eigen::AngleAxisd(turns * X[0] / 2 + i, Eigen::Vector3d::UnitX()) *
                                           Eigen::AngleAxisd(0.5 * turns * X[0], Eigen::Vector3d::UnitZ()))
                                              .toRotationMatrix();
                state.x.row(k) = (R * (X - Eigen::Vector3d(1, 0.2, 0.2))).transpose();
                state.v(k, 1) = std::sin(3 * X[0]);
            }
            systems[static_cast<std::size_t>(i)].assemble(state, dt,
                                                          {.gravity = {0, 0, -9.81}, .forces = {}});
            first_unknown.push_back(first_unknown.back() + body.unknown_count());
        }
        systems[0].prescribe({.nodes = {0, 1, 2, 3, 4, 5}, .v = Nodes::Constant(6, 3, 0.1)});
        for (int k = 40; stiffness > 0 && k < 60; ++k) {
            Coupling coupling{.begin = static_cast<int>(terms.size())};
            terms.push_back({0, k, 3 * k, 1, systems[0].is_prescribed(k)});
            terms.push_back({1, k + 1, first_unknown[1] + 3 * (k + 1), -1, false});
            coupling.end = static_cast<int>(terms.size());
            const Eigen::Vector3d n = Eigen::Vector3d(std::sin(k), std::cos(k), 0.3).normalized();
            coupling.A = stiffness * n * n.transpose();
            couplings.push_back(coupling);
        }
        b.resize(first_unknown.back());
        for (std::size_t i = 0; i < 2; ++i)
            b.segment(first_unknown[i], body.unknown_count()) = systems[i].rhs();
    }

    CoupledSystem system() const { return {systems, first_unknown, terms, couplings}; }

    Eigen::VectorXd solve(const LinearSolveConfig& config, LinearSolveReport& report) const {
        CoupledSolver solver(config);
        solver.begin_matrices(system());
        Eigen::VectorXd v = Eigen::VectorXd::Zero(b.size());
        report = solver.solve(system(), b, config.tolerance * b.norm(), v);
        return v;
    }

    double residual(const Eigen::VectorXd& v) const {
        Eigen::VectorXd product(v.size());
        system().multiply(v, product);
        return (b - product).norm() / b.norm();
    }
};

TEST(CoupledSolver, ConvergesInFewIterationsForTwistedBodiesInContact) {
    for (const double turns : {0.0, 1.0, 3.0})
        for (const double stiffness : {0.0, 1.0, 1e3}) {
            const Scene scene(turns, stiffness);
            LinearSolveReport report;
            const Eigen::VectorXd v = scene.solve({.tolerance = 1e-8}, report);
            EXPECT_TRUE(report.converged);
            EXPECT_EQ(report.fallback, "");
            EXPECT_LE(scene.residual(v), 1e-8);
            EXPECT_LT(report.iterations, 30) << turns << " " << stiffness;
        }
}

TEST(CoupledSolver, AgreesWithTheDirectSolve) {
    const Scene scene(2, 100);
    LinearSolveReport iterative, direct;
    const Eigen::VectorXd v = scene.solve({.tolerance = 1e-10}, iterative);
    const Eigen::VectorXd exact = scene.solve({.solver = LinearSolver::direct, .tolerance = 1e-10}, direct);
    EXPECT_EQ(direct.iterations, 0);
    EXPECT_LE(scene.residual(exact), 1e-12);
    EXPECT_LT((v - exact).norm(), 1e-7 * exact.norm());
}

TEST(CoupledSolver, KeepsPrescribedVelocities) {
    const Scene scene(2, 100);
    LinearSolveReport report;
    const Eigen::VectorXd v = scene.solve({}, report);
    EXPECT_NEAR((v.head(18).array() - 0.1).abs().maxCoeff(), 0, 1e-12);
}

TEST(CoupledSolver, FallsBackToFactorisationWhenTheIterationDoesNotConverge) {
    const Scene scene(2, 100);
    LinearSolveReport report;
    const Eigen::VectorXd v = scene.solve({.tolerance = 1e-9, .max_iterations = 1}, report);
    EXPECT_TRUE(report.converged);
    EXPECT_NE(report.fallback.find("iterations left a relative residual of"), std::string::npos)
        << report.fallback;
    EXPECT_LE(scene.residual(v), 1e-9);
}

TEST(CoupledSolver, FallsBackToFactorisationForTooManyCoupledNodes) {
    Scene scene(0.5);
    for (int k = 0; k < scene.body.node_count(); k += 3) {
        scene.terms.push_back({1, k, scene.first_unknown[1] + 3 * k, 1, false});
        const int end = static_cast<int>(scene.terms.size());
        scene.couplings.push_back({end - 1, end, Eigen::Matrix3d::Identity()});
    }
    for (int k = 100; k < scene.body.node_count(); k += 3) {
        scene.terms.push_back({0, k, 3 * k, 1, false});
        const int end = static_cast<int>(scene.terms.size());
        scene.couplings.push_back({end - 1, end, Eigen::Matrix3d::Identity()});
    }
    LinearSolveReport report;
    const Eigen::VectorXd v = scene.solve({}, report);
    EXPECT_NE(report.fallback.find("nodes"), std::string::npos) << report.fallback;
    EXPECT_LE(scene.residual(v), 1e-6);
}

TEST(CoupledSolver, SolvesTheSameMatricesWithOtherCouplings) {
    Scene scene(1, 10);
    for (const LinearSolver kind : {LinearSolver::iterative, LinearSolver::direct}) {
        CoupledSolver solver({.solver = kind});
        solver.begin_matrices(scene.system());
        Eigen::VectorXd v = Eigen::VectorXd::Zero(scene.b.size());
        solver.solve(scene.system(), scene.b, 1e-6 * scene.b.norm(), v);
        const std::vector<Coupling> before = scene.couplings;
        for (std::size_t parity = 0; parity < 2; ++parity) {
            for (std::size_t k = parity; k < scene.couplings.size(); k += 2) scene.couplings[k].A.setZero();
            EXPECT_TRUE(solver.solve(scene.system(), scene.b, 1e-6 * scene.b.norm(), v).converged);
            EXPECT_LE(scene.residual(v), 1e-6);
            scene.couplings = before;
        }
    }
}

TEST(CoupledSolver, LetsThePatchGrowWithTheCouplingsThatAct) {
    Scene scene(1, 10);
    const std::vector<Coupling> all = scene.couplings;
    for (std::size_t k = 0; k < all.size(); k += 2) scene.couplings[k].A.setZero();
    CoupledSolver solver;
    solver.begin_matrices(scene.system());
    Eigen::VectorXd v = Eigen::VectorXd::Zero(scene.b.size());
    const double goal = 1e-6 * scene.b.norm();
    const int few = solver.solve(scene.system(), scene.b, goal, v).patch_nodes;
    scene.couplings = all;
    const LinearSolveReport more = solver.solve(scene.system(), scene.b, goal, v);
    EXPECT_GE(more.patch_nodes, few);
    EXPECT_TRUE(more.converged);
    EXPECT_LE(scene.residual(v), 1e-6);

    CoupledSolver fresh;
    fresh.begin_matrices(scene.system());
    Eigen::VectorXd again = Eigen::VectorXd::Zero(scene.b.size());
    EXPECT_EQ(fresh.solve(scene.system(), scene.b, goal, again).patch_nodes, more.patch_nodes);
}

TEST(CoupledSolver, GivesTheSameBitsOnAnyNumberOfThreads) {
    Eigen::VectorXd one, four;
    const auto solve = [](Eigen::VectorXd& v) {
        const Scene scene(2, 100);
        LinearSolveReport report;
        v = scene.solve({}, report);
    };
    test::on_threads(1, [&] { solve(one); });
    test::on_threads(4, [&] { solve(four); });
    EXPECT_EQ(one, four);
}

}  // namespace
}  // namespace nbd
