#include "training/networks/mlp.hpp"

#include <gtest/gtest.h>

#include <array>
#include <stdexcept>

#include "collision/base/counter_random.hpp"
#include "training/networks/pose_blocks.hpp"

namespace nbd {
namespace {

PoseRows random_rows(int rows, int columns, std::uint64_t seed) {
    PoseRows x(rows, columns);
    for (Eigen::Index i = 0; i < x.size(); ++i)
        x.data()[i] = static_cast<float>(2 * counter_uniform(seed, 0, static_cast<std::uint64_t>(i)) - 1);
    return x;
}

/// Reference for the kernels: the network and its loss in double precision.
double reference_loss(const MlpShape& s, const Eigen::VectorXd& w, const PoseRows& x, const PoseRows& y) {
    using Matrix = Eigen::Map<const Eigen::MatrixXd>;
    using Vector = Eigen::Map<const Eigen::VectorXd>;
    const Matrix W1(w.data() + s.W1(), s.hidden, s.inputs), W2(w.data() + s.W2(), s.hidden, s.hidden),
        W3(w.data() + s.W3(), 4, s.hidden);
    const Vector b1(w.data() + s.b1(), s.hidden), b2(w.data() + s.b2(), s.hidden), b3(w.data() + s.b3(), 4);
    double sum = 0;
    for (int p = 0; p < x.rows(); ++p) {
        const Eigen::VectorXd h1 = (W1 * x.row(p).transpose().cast<double>() + b1).cwiseMax(0);
        const Eigen::VectorXd h2 = (W2 * h1 + b2).cwiseMax(0);
        sum += (W3 * h2 + b3 - y.row(p).transpose().cast<double>()).squaredNorm();
    }
    return sum / (4.0 * static_cast<double>(x.rows()));
}

constexpr std::array all_blocks{0, 1};  // of 21 poses

class Mlp : public testing::TestWithParam<MlpShape> {};

TEST_P(Mlp, GradientAgreesWithFiniteDifferences) {
    const MlpShape shape = GetParam();
    const int poses = 21;  // not a multiple of the block size
    const PoseRows x = random_rows(poses, shape.inputs, 1), y = random_rows(poses, 4, 2);
    Eigen::VectorXf w = initial_weights(shape, 3, 0);
    // Randomises biases too, since zero biases would hide their effect on the hidden layers.
    for (int i = 0; i < w.size(); ++i)
        if (w[i] == 0) w[i] = static_cast<float>(counter_uniform(4, 0, static_cast<std::uint64_t>(i)) - 0.4);

    const PoseBlocks blocks(x, Arithmetic::single, 7);
    MlpBatch batch(shape.hidden, blocks, y, 2);
    Eigen::VectorXf gradient(shape.weights());
    const float loss = batch.loss_and_gradient(w, all_blocks, gradient);
    EXPECT_EQ(loss, batch.loss(w, all_blocks));

    Eigen::VectorXd wd = w.cast<double>();
    EXPECT_NEAR(loss, reference_loss(shape, wd, x, y), 1e-5 * loss);
    const double step = 1e-7, tolerance = 2e-4 * gradient.cwiseAbs().maxCoeff();
    ASSERT_GT(tolerance, 0);
    const int stride = std::max(1, shape.weights() / 700);
    for (int i = 0; i < shape.weights(); i += stride) {
        const double kept = wd[i];
        wd[i] = kept + step;
        const double above = reference_loss(shape, wd, x, y);
        wd[i] = kept - step;
        const double below = reference_loss(shape, wd, x, y);
        wd[i] = kept;
        EXPECT_NEAR(gradient[i], (above - below) / (2 * step), tolerance) << "weight " << i;
    }
}

TEST_P(Mlp, MixedArithmeticAgreesWithFloatsUpToRounding) {
    if (!has_arithmetic(Arithmetic::mixed)) GTEST_SKIP() << "no bfloat16 instructions in this build";
    const MlpShape shape = GetParam();
    const PoseRows x = random_rows(21, shape.inputs, 1), y = random_rows(21, 4, 2);
    const Eigen::VectorXf w = initial_weights(shape, 3, 0);
    const auto run = [&](Arithmetic arithmetic) {
        const PoseBlocks blocks(x, arithmetic, 7);
        MlpBatch batch(shape.hidden, blocks, y, 2);
        Eigen::VectorXf result(shape.weights() + 1), gradient(shape.weights());
        result[shape.weights()] = batch.loss_and_gradient(w, all_blocks, gradient);
        result.head(shape.weights()) = gradient;
        return result;
    };
    const Eigen::VectorXf single = run(Arithmetic::single), mixed = run(Arithmetic::mixed);
    EXPECT_NE(single, mixed);
    EXPECT_LT((single - mixed).norm(), 0.02f * single.norm());
}

INSTANTIATE_TEST_SUITE_P(Shapes, Mlp,
                         testing::Values(MlpShape{.inputs = 5, .hidden = 16}, MlpShape{.inputs = 37},
                                         MlpShape{.inputs = 9, .hidden = 64}, MlpShape{.inputs = 1}));

TEST(Mlp, RejectsUnsupportedShapes) {
    EXPECT_THROW(check_mlp_shape({.inputs = 4, .hidden = 20}), std::invalid_argument);
    EXPECT_THROW(check_mlp_shape({.inputs = 0, .hidden = 32}), std::invalid_argument);
    EXPECT_NO_THROW(check_mlp_shape({.inputs = 4, .hidden = 64}));
}

}  // namespace
}  // namespace nbd
