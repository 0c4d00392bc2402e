#include "sim/factor/packed_factor.hpp"

#include <gtest/gtest.h>

#include "sim/fem/step_system.hpp"
#include "tests/support/box_body.hpp"
#include "tests/support/box_mesh.hpp"
#include "tests/support/on_threads.hpp"

namespace nbd {
namespace {

struct Packed {
    SparseMatrix A;
    Cholesky cholesky;
    std::unique_ptr<PackedFactor> factor;

    explicit Packed(const Eigen::Vector3i& cells) {
        const ElasticBody body(test::box_mesh({1, 0.7, 0.5}, cells), {.young = 1e5});
        ElementPose pose;
        body.pose(body.rest().X, pose);
        A = body.pattern().zero_matrix();
        body.combine(1, 1e-4, pose, A);
        cholesky.analyze(A);
        cholesky.factorize(A);
        factor = std::make_unique<PackedFactor>(cholesky.factor());
    }

    Eigen::VectorXf solve(const Eigen::VectorXd& b) const {
        const std::vector<int>& order = factor->order();
        std::vector<float> y, work;
        for (const int unknown : order) y.push_back(static_cast<float>(b[unknown]));
        factor->solve(y, work);
        Eigen::VectorXf x(b.size());
        for (std::size_t k = 0; k < order.size(); ++k) x[order[k]] = y[k];
        return x;
    }
};

Eigen::VectorXd waves(Eigen::Index size, double frequency) {
    return (Eigen::ArrayXd::LinSpaced(size, 0, static_cast<double>(size)) * frequency).sin();
}

TEST(PackedFactor, SolvesToAboutThreeDigits) {
    for (const Eigen::Vector3i& cells : {Eigen::Vector3i(1, 1, 1), Eigen::Vector3i(9, 7, 5)}) {
        const Packed packed(cells);
        for (const double frequency : {0.01, 0.7, 2.9}) {
            const Eigen::VectorXd b = waves(packed.A.cols(), frequency);
            Eigen::VectorXd exact(b.size());
            packed.cholesky.solve(b, exact);
            EXPECT_LT((packed.solve(b).cast<double>() - exact).norm(), 1e-3 * exact.norm());
        }
    }
}

TEST(PackedFactor, IsSymmetricAndPositive) {
    const Packed packed({6, 5, 4});
    const Eigen::VectorXd a = waves(packed.A.cols(), 0.3), b = waves(packed.A.cols(), 1.1);
    const double ab = a.dot(packed.solve(b).cast<double>()), ba = b.dot(packed.solve(a).cast<double>());
    const double aa = a.dot(packed.solve(a).cast<double>()), bb = b.dot(packed.solve(b).cast<double>());
    EXPECT_GT(aa, 0);
    EXPECT_GT(bb, 0);
    EXPECT_NEAR(ab, ba, 1e-5 * std::sqrt(aa * bb));
}

TEST(PackedFactor, GivesTheSameBitsOnAnyNumberOfThreads) {
    const Packed packed({9, 7, 5});
    const Eigen::VectorXd b = waves(packed.A.cols(), 0.3);
    Eigen::VectorXf one, four;
    test::on_threads(1, [&] { one = packed.solve(b); });
    test::on_threads(4, [&] { four = packed.solve(b); });
    EXPECT_EQ(one, four);
}

TEST(PackedFactor, UsesAQuarterOfTheFactorsMemory) {
    const Packed packed({14, 12, 10});
    EXPECT_LT(static_cast<double>(packed.factor->bytes()),
              0.4 * 8 * static_cast<double>(packed.cholesky.factor_entries()));
}

}  // namespace
}  // namespace nbd
