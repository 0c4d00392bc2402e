#include "apps/bench/solvers/deflated_cycle.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "sim/fem/modes.hpp"
#include "tests/support/box_body.hpp"

namespace nbd {
namespace {

/// A translation of the nodes that are not held.
Eigen::VectorXd translation(const StepProblem& problem) {
    Eigen::VectorXd w = Eigen::VectorXd::Zero(problem.b.size());
    for (int i = 0; i < w.size() / 3; ++i)
        if (!problem.system.is_prescribed(i)) w.segment<3>(3 * i) = Eigen::Vector3d(1, -2, 0.5);
    return w;
}

/// The cosine between the translation and what a cycle leaves of some residual.
double left_along_translation(const StepProblem& problem, DeflatedCycle& cycle) {
    Eigen::VectorXd r(problem.b.size()), z;
    for (Eigen::Index k = 0; k < r.size(); ++k) r[k] = std::sin(0.1 * static_cast<double>(k));
    cycle.apply(r, z);
    const Eigen::VectorXd left = r - problem.A * z, w = translation(problem);
    return w.dot(left) / (w.norm() * left.norm());
}

TEST(DeflatedCycle, LeavesNothingAlongItsMotions) {
    const Body body = test::box_body({1, 0.4, 0.3}, {8, 4, 3});
    const auto elastic = std::make_shared<const ElasticBody>(body);
    const Eigen::MatrixXf U = vibration_modes(*elastic, {.count = 10}).basis.U;
    for (const auto& [rest, moved] : step_problems(body, elastic, 2)) {
        SCOPED_TRACE(moved.scene);
        DeflatedCycle deflated(moved, U, 16), plain(moved, U, 0);
        deflated.set_up();
        plain.set_up();
        const Eigen::VectorXd w = translation(moved);
        Eigen::VectorXd v;
        ASSERT_TRUE(deflated.guess(moved.A * w, v));
        EXPECT_LT((v - w).norm(), 1e-3 * w.norm());
        EXPECT_FALSE(plain.guess(moved.A * w, v));
        const double left = std::abs(left_along_translation(moved, plain));
        EXPECT_GT(left, 1e-3);
        EXPECT_LT(std::abs(left_along_translation(moved, deflated)), 0.1 * left);
    }
}

}  // namespace
}  // namespace nbd
