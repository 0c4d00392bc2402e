#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "sim/factor/cholesky.hpp"
#include "sim/fem/elastic_body.hpp"
#include "sim/fem/step_system.hpp"
#include "tests/sim/support/matrices.hpp"
#include "tests/support/box_mesh.hpp"
#include "tests/support/error_of.hpp"

namespace nbd {
namespace {

std::string refusal(const TetMesh& mesh, const Material& material,
                    const std::vector<MaterialRegion>& regions = {}) {
    return test::refusal([&] { ElasticBody(mesh, material, regions); });
}

TEST(ElasticBody, RejectsInvalidRegions) {
    const TetMesh box = test::box_mesh({1, 1, 1}, {1, 1, 1});
    const Material material;
    EXPECT_EQ(refusal(box, material, {{.name = "a", .material = material, .tets = {0, 6}}}),
              "region \"a\": it has tetrahedron 6; allowed: 0 to 5");
    EXPECT_EQ(refusal(box, material,
                      {{.name = "a", .material = material, .tets = {0, 1}},
                       {.name = "b", .material = material, .tets = {1}}}),
              "region \"b\": tetrahedron 1 is in a region already; allowed: one each");
    EXPECT_EQ(refusal(box, material,
                      {{.name = "a", .material = material, .tets = {0}},
                       {.name = "a", .material = material, .tets = {1}}}),
              "region \"a\": its name is empty or taken; allowed: a name of its own");
    EXPECT_EQ(refusal(box, material, {{.name = "a", .material = {.rayleigh_mass = 7}, .tets = {0}}}),
              "region \"a\": its damping differs; allowed: that of the body");
    EXPECT_EQ(refusal(box, material, {{.name = "a", .material = {.poisson = 0.6}, .tets = {0}}}),
              "region \"a\": Poisson's ratio is 0.6; allowed: between -0.999 and 0.4999");
    EXPECT_EQ(refusal(box, material, {{.name = "a", .material = material, .tets = {}}}),
              "region \"a\": it has no tetrahedra; allowed: at least one");
}

TEST(ElasticBody, RejectsInvalidMaterials) {
    const TetMesh box = test::box_mesh({1, 1, 1}, {1, 1, 1});
    EXPECT_EQ(refusal(box, {.young = 0}), "Young's modulus is 0; allowed: between 1e-30 and 1e30 Pa");
    EXPECT_EQ(refusal(box, {.young = std::numeric_limits<double>::infinity()}),
              "Young's modulus is inf; allowed: between 1e-30 and 1e30 Pa");
    EXPECT_EQ(refusal(box, {.young = 1e300}),
              "Young's modulus is 1e+300; allowed: between 1e-30 and 1e30 Pa");
    EXPECT_EQ(refusal(box, {.poisson = 0.5}), "Poisson's ratio is 0.5; allowed: between -0.999 and 0.4999");
    EXPECT_EQ(refusal(box, {.poisson = -1}), "Poisson's ratio is -1; allowed: between -0.999 and 0.4999");
    EXPECT_EQ(refusal(box, {.density = -2}), "density is -2; allowed: between 1e-30 and 1e30 kg/m3");
    EXPECT_EQ(refusal(box, {.rayleigh_mass = -1}),
              "Rayleigh mass damping is -1; allowed: between 0 and 1e30 1/s");
    EXPECT_EQ(refusal(box, {.rayleigh_stiffness = std::nan("")}),
              "Rayleigh stiffness damping is nan; allowed: between 0 and 1e30 s");
}

TEST(ElasticBody, RejectsInvalidMeshes) {
    const TetMesh box = test::box_mesh({1, 1, 1}, {1, 1, 1});
    TetMesh bad = box;
    bad.T(2, 1) = 8;
    EXPECT_EQ(refusal(bad, {}), "tetrahedron 2 refers to node 8, but the mesh has 8 nodes");
    bad = box;
    bad.T(3, 0) = -1;
    EXPECT_EQ(refusal(bad, {}), "tetrahedron 3 refers to node -1, but the mesh has 8 nodes");
    bad = box;
    std::swap(bad.T(4, 0), bad.T(4, 1));
    EXPECT_EQ(refusal(bad, {}).substr(0, 26), "tetrahedron 4 has volume -");
    bad = box;
    bad.X(5, 1) = std::nan("");
    EXPECT_EQ(refusal(bad, {}), "node 5 lies at (1 nan 1); allowed: finite positions");
    bad = box;
    bad.X = Nodes::Zero(9, 3);
    bad.X.topRows(8) = box.X;
    EXPECT_EQ(refusal(bad, {}), "node 8 belongs to no tetrahedron");
    bad.T.resize(0, 4);
    EXPECT_EQ(refusal(bad, {}), "elastic body: no tetrahedra; allowed: at least one");
}

class StepSystemOfABar : public ::testing::Test {
 protected:
    StepSystemOfABar() : body(test::box_mesh({1, 0.5, 0.5}, {4, 2, 2}, 0.2), Material{}), system(body) {
        state.x = body.rest().X + test::wild_field(body.rest().X, 0.02);
        state.v = test::wild_field(body.rest().X, 0.7);
    }
    SparseMatrix matrix() const { return test::sparse(body, system.matrix()); }
    Eigen::VectorXd solution() {
        Eigen::VectorXd v(body.unknown_count());
        Cholesky cholesky;
        cholesky.analyze(matrix());
        cholesky.factorize(matrix());
        cholesky.solve(system.rhs(), v);
        return v;
    }
    ElasticBody body;
    StepSystem system;
    BodyState state;
    const double dt = 0.01;
};

TEST_F(StepSystemOfABar, EliminationSolvesTheReducedSystem) {
    system.assemble(StepStart(state), dt, {.gravity = {0, -9.81, 0}, .forces = {}});
    const Eigen::MatrixXd A = matrix();
    const Eigen::VectorXd b = system.rhs();
    PrescribedNodes grips{{2, 11, 7}, Nodes(3, 3)};
    grips.v << 0, 0, 0, 1, -2, 3, 0.5, 0, 0;
    system.prescribe(grips);
    const Eigen::VectorXd v = solution();
    std::vector<int> free_rows, fixed_rows;
    Eigen::VectorXd given(9);
    for (int k = 0; k < 3; ++k)
        for (int c = 0; c < 3; ++c) {
            fixed_rows.push_back(3 * grips.nodes[k] + c);
            given[3 * k + c] = grips.v(k, c);
        }
    for (int r = 0; r < body.unknown_count(); ++r)
        if (!system.is_prescribed(r / 3)) free_rows.push_back(r);
    ASSERT_EQ(free_rows.size() + 9, static_cast<std::size_t>(body.unknown_count()));
    const Eigen::VectorXd expected =
        Eigen::MatrixXd(A(free_rows, free_rows))
            .llt()
            .solve(b(free_rows) - Eigen::MatrixXd(A(free_rows, fixed_rows)) * given);
    EXPECT_LT((v(free_rows) - expected).norm(), 1e-6 * expected.norm());  // single precision
    EXPECT_EQ(Eigen::VectorXd(v(fixed_rows)), given);
    Eigen::VectorXd Av(v.size());
    system.multiply(v, Av);
    EXPECT_LT((Av - matrix() * v).norm(), 1e-6 * (A * v).norm());
}

TEST_F(StepSystemOfABar, AssembleClearsPrescribedNodes) {
    system.assemble(StepStart(state), dt, {});
    const Eigen::MatrixXd A = matrix();
    const Eigen::VectorXd b = system.rhs();
    system.prescribe({{3}, Nodes::Zero(1, 3)});
    EXPECT_TRUE(system.is_prescribed(3));
    system.assemble(StepStart(state), dt, {});
    EXPECT_TRUE(Eigen::MatrixXd(matrix()) == A);
    EXPECT_TRUE(system.rhs() == b);
    EXPECT_FALSE(system.is_prescribed(3));
}

TEST_F(StepSystemOfABar, MultipliesTheSameWhateverItMultipliedBefore) {
    const auto product = [](const StepSystem& A, const Nodes& v) {
        Eigen::VectorXd result(v.size());
        A.multiply(v.reshaped<Eigen::RowMajor>(), result);
        return result;
    };
    const Nodes other = test::wild_field(body.rest().X, 0.3);
    system.assemble(StepStart(state), dt, {});
    const Eigen::VectorXd of_velocities = product(system, state.v), of_other = product(system, other);
    EXPECT_NE(of_velocities, of_other);
    EXPECT_EQ(product(system, state.v), of_velocities);
    EXPECT_EQ(product(system, state.v), of_velocities);

    state.x *= 1.1;
    state.x.col(0).swap(state.x.col(1));
    system.assemble(StepStart(state), dt, {});
    StepSystem fresh(body);
    fresh.assemble(StepStart(state), dt, {});
    const Eigen::VectorXd of_another_pose = product(fresh, other);
    EXPECT_NE(of_another_pose, of_other);
    EXPECT_EQ(product(system, state.v), product(fresh, state.v));
    EXPECT_EQ(product(system, other), of_another_pose);

    const PrescribedNodes held{{3}, Nodes::Zero(1, 3)};
    system.prescribe(held);
    fresh.prescribe(held);
    product(system, state.v);
    EXPECT_EQ(product(system, state.v), product(fresh, state.v));
}

TEST_F(StepSystemOfABar, RejectsInvalidArguments) {
    const BodyState bad{state.x.topRows(7), state.v};
    EXPECT_EQ(test::refusal([&] { system.assemble(StepStart(bad), dt, {}); }),
              "step: x has 7 rows, the body has 45 nodes");
    EXPECT_EQ(test::refusal([&] { system.assemble(StepStart(state), 0, {}); }),
              "step: dt is 0 s, allowed: finite and > 0");
    EXPECT_EQ(test::refusal([&] { system.assemble(StepStart(state), dt, {.forces = Nodes::Zero(3, 3)}); }),
              "step: forces has 3 rows, the body has 45 nodes");
    system.assemble(StepStart(state), dt, {});
    const auto prescribe = [&](std::vector<int> nodes, const Nodes& v) {
        return test::refusal([&] { system.prescribe({nodes, v}); });
    };
    EXPECT_EQ(prescribe({45}, Nodes::Zero(1, 3)), "step: prescribed node 45, but the body has 45 nodes");
    EXPECT_EQ(prescribe({4, 4}, Nodes::Zero(2, 3)), "step: node 4 is prescribed twice");
    EXPECT_EQ(prescribe({4}, Nodes::Zero(2, 3)), "step: 1 prescribed nodes, but 2 velocities");
    EXPECT_EQ(prescribe({5}, Nodes::Constant(1, 3, INFINITY)),
              "step: node 5 has a non-finite prescribed velocity");
}

}  // namespace
}  // namespace nbd
