#include "sim/solvers/coupled_solver.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <vector>

#include "sim/solvers/body_norms.hpp"
#include "sim/solvers/patch_factor.hpp"
#include "tests/support/box_body.hpp"
#include "tests/support/box_mesh.hpp"
#include "tests/support/on_threads.hpp"

namespace nbd {
namespace {

/// Two twisted and bent bars, one fixed at an end, coupled at some nodes.
struct TwistedBars {
    static constexpr double dt = 0.01;
    ElasticBody body{test::box_mesh({2, 0.4, 0.4}, {24, 5, 5}), {.young = 1e5}};
    std::vector<StepSystem> systems;
    std::vector<int> first_unknown{0};
    std::vector<CouplingTerm> terms;
    std::vector<Coupling> couplings;
    Eigen::VectorXd b;

    explicit TwistedBars(double turns, double stiffness = 0) {
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
            systems[i].assemble(StepStart(state), dt, {.gravity = {0, 0, -9.81}, .forces = {}});
            first_unknown.push_back(first_unknown.back() + body.unknown_count());
        }
        systems[0].prescribe({.nodes = {0, 1, 2, 3, 4, 5}, .v = Nodes::Constant(6, 3, 0.1)});
        for (int k = 40; stiffness > 0 && k < 60; ++k) {
            Coupling coupling{.begin = int(terms.size())};
            terms.push_back({0, k, 3 * k, 1, systems[0].is_prescribed(k)});
            terms.push_back({1, k + 1, first_unknown[1] + 3 * (k + 1), -1, false});
            coupling.end = terms.size();
            const Eigen::Vector3d n = Eigen::Vector3d(std::sin(k), std::cos(k), 0.3).normalized();
            coupling.A = stiffness * n * n.transpose();
            couplings.push_back(coupling);
        }
        b.resize(first_unknown.back());
        for (std::size_t i = 0; i < 2; ++i)
            b.segment(first_unknown[i], body.unknown_count()) = systems[i].rhs();
    }

    CoupledSystem system() const { return {systems, first_unknown, terms, couplings}; }

    /// A share of the norm of each body's right-hand side.
    std::vector<double> goals(double share) const {
        std::vector<double> norms = body_norms().of(b);
        for (double& norm : norms) norm *= share;
        return norms;
    }

    /// The largest residual of a body, as a share of the norm of its right-hand side.
    double residual(const Eigen::VectorXd& v) const {
        Eigen::VectorXd product(v.size());
        system().multiply(v, product);
        return worst_share(body_norms().of(b - product), goals(1));
    }

 private:
    BodyNorms body_norms() const {
        BodyNorms norms;
        norms.begin(systems, first_unknown);
        return norms;
    }
};

Eigen::VectorXd solve(const TwistedBars& scene, const LinearSolveConfig& config, LinearSolveReport& report) {
    CoupledSolver solver(config);
    solver.begin_matrices(scene.system());
    Eigen::VectorXd v = Eigen::VectorXd::Zero(scene.b.size());
    report = solver.solve(scene.system(), scene.b, scene.goals(config.tolerance), v);
    return v;
}

TEST(CoupledSolver, ConvergesInFewIterationsForTwistedBodiesInContact) {
    for (const double turns : {0.0, 1.0, 3.0})
        for (const double stiffness : {0.0, 1.0, 1e3, 1e6}) {
            const TwistedBars scene(turns, stiffness);
            LinearSolveReport report;
            const Eigen::VectorXd v = solve(scene, {.tolerance = 1e-8}, report);
            EXPECT_TRUE(report.converged);
            EXPECT_EQ(report.fallback, "");
            EXPECT_LE(scene.residual(v), 1e-8);
            EXPECT_LT(report.iterations, 70) << turns << " " << stiffness;
        }
}

TEST(CoupledSolver, AgreesWithTheDirectSolve) {
    for (const double stiffness : {0, 100}) {
        const TwistedBars scene(2, stiffness);
        LinearSolveReport iterative, direct;
        const Eigen::VectorXd v = solve(scene, {.tolerance = 1e-10}, iterative);
        const Eigen::VectorXd exact =
            solve(scene, {.solver = LinearSolver::direct, .tolerance = 1e-10}, direct);
        EXPECT_EQ(direct.iterations, 0);
        EXPECT_LE(scene.residual(exact), 1e-12);
        EXPECT_LT((v - exact).norm(), 1e-7 * exact.norm());
    }
}

TEST(CoupledSolver, KeepsPrescribedVelocities) {
    const TwistedBars scene(2, 100);
    LinearSolveReport report;
    const Eigen::VectorXd v = solve(scene, {.tolerance = 1e-6}, report);
    EXPECT_NEAR((v.head(18).array() - 0.1).abs().maxCoeff(), 0, 1e-12);
}

TEST(CoupledSolver, FallsBackToFactorisationWhenTheIterationDoesNotConverge) {
    const TwistedBars scene(2, 100);
    LinearSolveReport report;
    const Eigen::VectorXd v = solve(scene, {.tolerance = 1e-9, .max_iterations = 1}, report);
    EXPECT_TRUE(report.converged);
    EXPECT_NE(report.fallback.find("times the residual that is allowed"), std::string::npos)
        << report.fallback;
    EXPECT_LE(scene.residual(v), 1e-9);
}

TEST(CoupledSolver, ConvergesWithCouplingsAtMostNodes) {
    TwistedBars scene(0.5);
    for (int k = 0; k < scene.body.node_count(); k += 3) {
        scene.terms.push_back({1, k, scene.first_unknown[1] + 3 * k, 1, false});
        const int end = scene.terms.size();
        scene.couplings.push_back({end - 1, end, Eigen::Matrix3d::Identity()});
    }
    for (int k = 100; k < scene.body.node_count(); k += 3) {
        scene.terms.push_back({0, k, 3 * k, 1, false});
        const int end = scene.terms.size();
        scene.couplings.push_back({end - 1, end, Eigen::Matrix3d::Identity()});
    }
    LinearSolveReport report;
    const Eigen::VectorXd v = solve(scene, {.tolerance = 1e-6}, report);
    EXPECT_EQ(report.fallback, "");
    EXPECT_LE(scene.residual(v), 1e-6);
}

TEST(CoupledSolver, SolvesTheSameMatricesWithOtherCouplings) {
    TwistedBars scene(1, 10);
    for (const LinearSolver kind : {LinearSolver::iterative, LinearSolver::direct}) {
        CoupledSolver solver({.solver = kind});
        solver.begin_matrices(scene.system());
        Eigen::VectorXd v = Eigen::VectorXd::Zero(scene.b.size());
        solver.solve(scene.system(), scene.b, scene.goals(1e-6), v);
        const std::vector<Coupling> before = scene.couplings;
        for (std::size_t parity = 0; parity < 2; ++parity) {
            for (std::size_t k = parity; k < scene.couplings.size(); k += 2) scene.couplings[k].A.setZero();
            EXPECT_TRUE(solver.solve(scene.system(), scene.b, scene.goals(1e-6), v).converged);
            EXPECT_LE(scene.residual(v), 1e-6);
            scene.couplings = before;
        }
    }
}

TEST(CoupledSolver, SolvesWithCouplingsThatBeginToActLater) {
    for (const LinearSolver kind : {LinearSolver::iterative, LinearSolver::direct}) {
        TwistedBars scene(1, 10);
        const std::vector<Coupling> all = scene.couplings;
        for (std::size_t k = 0; k < all.size(); ++k)
            if (k % 3 > 0) scene.couplings[k].A.setZero();
        CoupledSolver solver({.solver = kind});
        solver.begin_matrices(scene.system());
        Eigen::VectorXd v = Eigen::VectorXd::Zero(scene.b.size());
        for (const std::size_t more : {0, 1, 2}) {
            for (std::size_t k = more; k < all.size(); k += 3) scene.couplings[k].A = all[k].A;
            EXPECT_TRUE(solver.solve(scene.system(), scene.b, scene.goals(1e-6), v).converged);
            EXPECT_LE(scene.residual(v), 1e-6);
        }
    }
}

/// One norm over both would let the small one stand still.
TEST(CoupledSolver, SolvesEachBodyAsWellBesideAnotherAsAlone) {
    for (const double factor : {1e-9, 1.0, 1e9}) {
        TwistedBars scene(2);
        scene.b.tail(scene.body.unknown_count()) *= factor;
        LinearSolveReport report;
        const Eigen::VectorXd v = solve(scene, {.tolerance = 1e-6}, report);
        EXPECT_EQ(report.fallback, "");
        EXPECT_LE(scene.residual(v), 1e-6) << factor;
        EXPECT_LT(report.iterations, 70) << factor;
    }
}

/// A goal of zero stands for what rounding leaves.
TEST(CoupledSolver, AsksForNoMoreThanRoundingAllows) {
    const TwistedBars scene(2, 100);
    LinearSolveReport report;
    const Eigen::VectorXd v = solve(scene, {.tolerance = 0}, report);
    EXPECT_TRUE(report.converged);
    EXPECT_EQ(report.fallback, "");
    EXPECT_LT(scene.residual(v), 1e-12);
}

/// All nodes are in the patch, whose solve leaves nothing for the iteration.
TEST(CoupledSolver, SolvesWhereContactsCoupleAllNodes) {
    TwistedBars scene(0);
    const int nodes = scene.first_unknown[1] / 3;
    for (int k = 0; k < nodes; ++k) {
        const int begin = scene.terms.size();
        scene.terms.push_back({0, k, 3 * k, 1, scene.systems[0].is_prescribed(k)});
        scene.terms.push_back({1, k, scene.first_unknown[1] + 3 * k, -1, false});
        scene.couplings.push_back({begin, begin + 2, Eigen::Matrix3d::Identity()});
    }
    LinearSolveReport report;
    const Eigen::VectorXd v = solve(scene, {.tolerance = 1e-6}, report);
    EXPECT_TRUE(v.allFinite());
    EXPECT_EQ(report.fallback, "");
    EXPECT_LE(scene.residual(v), 1e-6);
}

/// Iterations of a bent bar that falls, from rest to a residual of 1e-6. stiff: Young's modulus of every
/// fourth slice of the bar; 0: that of the material.
int iterations(const Eigen::Vector3i& cells, const Material& material, double step, double stiff = 0,
               const LinearSolveConfig& config = {}) {
    const TetMesh tets = test::box_mesh({2, 0.5, 0.5}, {cells[0], cells[1], cells[2]});
    MaterialRegion slices{.name = "slices", .material = material, .tets = {}};
    slices.material.young = stiff;
    for (int t = 0; t < tets.T.rows(); ++t)
        if (static_cast<int>(8 * test::centre(tets, t)[0]) % 4 == 3) slices.tets.push_back(t);
    std::vector<MaterialRegion> regions;
    if (stiff > 0) regions.push_back(slices);
    const ElasticBody body(tets, material, regions);
    BodyState state{body.rest().X, Nodes::Zero(body.node_count(), 3)};
    state.x.col(1) = state.x.col(1).array() + 0.2 * state.x.col(0).array().square();
    std::vector<StepSystem> systems;
    systems.emplace_back(body);
    systems[0].assemble(StepStart(state), step, {.gravity = {0, 0, -9.81}, .forces = {}});
    const std::vector<int> first{0, body.unknown_count()};
    const CoupledSystem system{systems, first, {}, {}};
    CoupledSolver solver(config);
    solver.begin_matrices(system);
    Eigen::VectorXd v = Eigen::VectorXd::Zero(body.unknown_count());
    const LinearSolveReport report =
        solver.solve(system, systems[0].rhs(), {1e-6 * solver.norms().of(systems[0].rhs())[0]}, v);
    EXPECT_TRUE(report.converged);
    EXPECT_EQ(report.fallback, "");
    return report.iterations;
}

TEST(CoupledSolver, NeedsHardlyMoreIterationsForFinerBodiesStifferMaterialsAndLongerSteps) {
    const Material soft{.young = 1e5, .poisson = 0.3};
    const int coarse = iterations({16, 4, 4}, soft, 0.01);
    EXPECT_GT(coarse, 3);
    EXPECT_LE(iterations({48, 12, 12}, soft, 0.01), 2 * coarse);  // 22 times the nodes
    EXPECT_LE(iterations({16, 4, 4}, {.young = 1e5, .poisson = 0.45}, 0.01), 2 * coarse);
    EXPECT_LE(iterations({16, 4, 4}, soft, 0.1), 2 * coarse);
    EXPECT_LE(iterations({16, 4, 4}, {.young = 1e8, .poisson = 0.3}, 0.01), 3 * coarse);
    EXPECT_LE(iterations({16, 4, 4}, soft, 0.01, 1e8), 3 * coarse);  // parts a thousand times stiffer
    EXPECT_LE(iterations({16, 4, 4}, {.young = 1e9, .poisson = 0.3}, 0.01), 7 * coarse);
}

TEST(CoupledSolver, LetsABodyOfTwentyThousandNodesIterateTwiceAsLong) {
    const Eigen::Vector3i cells(80, 16, 16);  // 23,409 nodes
    const Material soft{.young = 1e5, .poisson = 0.3};
    const int needed = iterations(cells, soft, 0.01);
    ASSERT_GT(needed, 4);
    EXPECT_EQ(iterations(cells, soft, 0.01, 0, {.max_iterations = needed / 2 + 1}), needed);
}

TEST(CoupledSolver, GivesTheSameBitsOnAnyNumberOfThreads) {
    for (const double stiffness : {0, 100}) {
        const TwistedBars scene(2, stiffness);
        Eigen::VectorXd one, four;
        LinearSolveReport report;
        test::on_threads(1, [&] { one = solve(scene, {.tolerance = 1e-6}, report); });
        test::on_threads(4, [&] { four = solve(scene, {.tolerance = 1e-6}, report); });
        EXPECT_EQ(one, four);
    }
}

/// The nodes of couplings `first` on.
std::vector<char> coupled_nodes(const CoupledSystem& system, std::size_t first) {
    std::vector<char> inside(system.node_count(), 0);
    for (std::size_t c = first; c < system.couplings.size(); ++c)
        for (const CouplingTerm& term : system.terms_of(system.couplings[c])) inside[term.unknown / 3] = 1;
    return inside;
}

/// Clears a residual on a patch, and holds what is left against the true one.
void expect_cleared(PatchFactor& patch, const TwistedBars& scene, const CouplingSum& couplings,
                    const std::vector<char>& inside) {
    const CoupledSystem system = scene.system();
    Eigen::VectorXd v = Eigen::VectorXd::LinSpaced(scene.b.size(), -1, 1), product(v.size());
    system.multiply(v, product);
    Eigen::VectorXd r = scene.b - product;
    const double before = r.norm();
    Eigen::VectorXd taken = Eigen::VectorXd::Zero(v.size());
    patch.take_residual(system, couplings, v, taken);
    for (Eigen::Index i = 0; i < v.size(); ++i)
        if (inside[i / 3]) {
            EXPECT_NEAR(taken[i], -product[i], 1e-5 * before);
        } else {
            EXPECT_EQ(taken[i], 0);
        }
    patch.clear(system, r, v);
    system.multiply(v, product);
    EXPECT_LT((r - (scene.b - product)).norm(), 1e-5 * before);  // matrices are in single precision
    for (Eigen::Index i = 0; i < system.node_count(); ++i)
        EXPECT_TRUE(!inside[i] || r.segment<3>(3 * i).isZero(0)) << i;
}

TEST(PatchFactor, ClearsTheResidualOnItsNodes) {
    TwistedBars scene(1, 100);
    for (std::size_t c = 0; c < 12; ++c) scene.couplings[c].A.setZero();  // do not act
    const CoupledSystem system = scene.system();
    CouplingSum couplings;
    couplings.begin(system);
    couplings.update(system);
    PatchFactor patch(Ordering::quick);
    const std::vector<char> few = coupled_nodes(system, 12), none(few.size(), 0);
    patch.begin();
    patch.factorize(system, couplings, few);
    expect_cleared(patch, scene, couplings, few);

    std::vector<char> more = few;
    std::fill_n(more.begin(), 40, char{1});  // prescribed nodes, too
    patch.factorize(system, couplings, more);
    expect_cleared(patch, scene, couplings, more);
    patch.factorize(system, couplings, few);  // keeps the others
    expect_cleared(patch, scene, couplings, more);

    patch.begin();
    patch.factorize(system, couplings, few);
    expect_cleared(patch, scene, couplings, few);
    EXPECT_EQ(patch.node_count(), std::ranges::count(few, 1));

    const TwistedBars apart(1);
    CouplingSum nothing;
    nothing.begin(apart.system());
    nothing.update(apart.system());
    patch.begin();
    patch.factorize(apart.system(), nothing, none);
    EXPECT_TRUE(patch.empty());
    expect_cleared(patch, apart, nothing, none);
}

}  // namespace
}  // namespace nbd
