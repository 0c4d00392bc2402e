#include "sim/fem/step_system.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>

#include "sim/factor/cholesky.hpp"
#include "tests/support/box_mesh.hpp"
#include "tests/support/error_of.hpp"

namespace nbd {
namespace {

class StepSystemOfABar : public ::testing::Test {
 protected:
    StepSystemOfABar() : body(test::box_mesh({1, 0.5, 0.5}, {4, 2, 2}, 0.2), Material{}), system(body) {
        state.x = body.rest().X + test::wild_field(body.rest().X, 0.02);
        state.v = test::wild_field(body.rest().X, 0.7);
    }
    Eigen::VectorXd solution() {
        Eigen::VectorXd v(body.unknown_count());
        Cholesky cholesky;
        cholesky.analyze(system.matrix().to_sparse());
        cholesky.factorize(system.matrix().to_sparse());
        cholesky.solve(system.rhs(), v);
        return v;
    }
    ElasticBody body;
    StepSystem system;
    BodyState state;
    const double dt = 0.01;
};

TEST_F(StepSystemOfABar, EliminationSolvesTheReducedSystem) {
    system.assemble(state, dt, {.gravity = {0, -9.81, 0}, .forces = {}});
    const Eigen::MatrixXd A = system.matrix().to_sparse();
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
    EXPECT_LT((Av - system.matrix().to_sparse() * v).norm(), 1e-6 * (A * v).norm());
}

TEST_F(StepSystemOfABar, AssembleClearsPrescribedNodes) {
    system.assemble(state, dt, {});
    const Eigen::MatrixXd A = system.matrix().to_sparse();
    const Eigen::VectorXd b = system.rhs();
    system.prescribe({{3}, Nodes::Zero(1, 3)});
    EXPECT_TRUE(system.is_prescribed(3));
    system.assemble(state, dt, {});
    EXPECT_TRUE(Eigen::MatrixXd(system.matrix().to_sparse()) == A);
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
    system.assemble(state, dt, {});
    const Eigen::VectorXd of_velocities = product(system, state.v), of_other = product(system, other);
    EXPECT_NE(of_velocities, of_other);
    EXPECT_EQ(product(system, state.v), of_velocities);
    EXPECT_EQ(product(system, state.v), of_velocities);

    state.x *= 1.1;
    state.x.col(0).swap(state.x.col(1));
    system.assemble(state, dt, {});
    StepSystem fresh(body);
    fresh.assemble(state, dt, {});
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
    EXPECT_EQ(test::refusal([&] { system.assemble(bad, dt, {}); }),
              "step: x has 7 rows, the body has 45 nodes");
    EXPECT_EQ(test::refusal([&] { system.assemble(state, 0, {}); }),
              "step: dt is 0 s, allowed: finite and > 0");
    EXPECT_EQ(test::refusal([&] { system.assemble(state, dt, {.forces = Nodes::Zero(3, 3)}); }),
              "step: forces has 3 rows, the body has 45 nodes");
    system.assemble(state, dt, {});
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
