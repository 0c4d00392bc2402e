#include "training/networks/mlp.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdlib>
#include <stdexcept>

#include "collision/base/counter_random.hpp"
#include "tests/support/on_threads.hpp"
#include "training/networks/adam.hpp"
#include "training/networks/network_fit.hpp"
#include "training/networks/pose_blocks.hpp"

namespace nbd {
namespace {

PoseRows random_rows(int rows, int columns, std::uint64_t seed) {
    PoseRows x(rows, columns);
    for (Eigen::Index i = 0; i < x.size(); ++i)
        x.data()[i] = static_cast<float>(2 * counter_uniform(seed, 0, i) - 1);
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
        if (w[i] == 0) w[i] = static_cast<float>(counter_uniform(4, 0, i) - 0.4);

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

/// One weight by algorithm 2 of [LoshchilovHutter19], written out in double precision.
struct Reference {
    double w, m = 0, v = 0;
    void step(double gradient, int t, double rate, double decay) {
        m = 0.9 * m + 0.1 * gradient;
        v = 0.999 * v + 0.001 * gradient * gradient;
        const double mean = m / (1 - std::pow(0.9, t)), square = v / (1 - std::pow(0.999, t));
        w -= rate * (mean / (std::sqrt(square) + 1e-8) + decay * w);
    }
};

TEST(Adam, FollowsItsDefinition) {
    constexpr int n = 37;  // not a multiple of any vector width
    for (const double decay : {0.0, 0.1}) {
        Eigen::VectorXf w = Eigen::VectorXf::LinSpaced(n, -1, 1);
        std::vector<Reference> expected;
        for (int i = 0; i < n; ++i) expected.push_back({w[i]});
        Adam adam(n, decay);
        for (int t = 1; t <= 50; ++t) {
            Eigen::VectorXf gradient(n);
            for (int i = 0; i < n; ++i)
                gradient[i] =
                    std::pow(10.f, static_cast<float>(i % 7 - 3)) * std::sin(static_cast<float>(i * t));
            const double rate = t < 30 ? 5e-3 : 1e-3;
            adam.step(gradient, rate, w);
            for (int i = 0; i < n; ++i) expected[i].step(gradient[i], t, rate, decay);
        }
        for (int i = 0; i < n; ++i) EXPECT_NEAR(w[i], expected[i].w, 1e-5) << decay << ' ' << i;
    }
}

TEST(Adam, LeavesWeightsWithZeroGradientUnchanged) {
    Eigen::VectorXf w = Eigen::VectorXf::Constant(20, 0.5f);
    Adam adam(20, 0);
    for (int t = 0; t < 5; ++t) adam.step(Eigen::VectorXf::Zero(20), 5e-3, w);
    EXPECT_EQ(w, Eigen::VectorXf::Constant(20, 0.5f));
}

/// Spheres of two nodes in 60 poses. The centres are affine in three modal coordinates, the radii random.
struct Linear {
    PoseRows z = PoseRows::Random(60, 3), spheres = PoseRows::Random(60, 8);
    Eigen::MatrixXf map = Eigen::MatrixXf::Random(3, 6);

    Linear() {
        for (int node = 0; node < 2; ++node)
            spheres.middleCols<3>(4 * node) =
                (z * map.middleCols<3>(3 * node)).rowwise() + Eigen::RowVector3f(1, -2, 3);
    }
};

TEST(LinearCentre, FindsTheLinearMapAndLeavesTheOffsetAndTheRadii) {
    Linear data;
    const PoseRows before = data.spheres;
    const Eigen::MatrixXf map = take_linear_centre(data.z, data.spheres);
    EXPECT_LT((map - data.map).cwiseAbs().maxCoeff(), 2e-3f);
    for (int node = 0; node < 2; ++node) {
        const PoseRows left = data.spheres.middleCols<3>(4 * node).rowwise() - Eigen::RowVector3f(1, -2, 3);
        EXPECT_LT(left.cwiseAbs().maxCoeff(), 5e-3f);
        EXPECT_EQ(data.spheres.col(4 * node + 3), before.col(4 * node + 3));
    }
}

TEST(LinearCentre, IgnoresAConstantCoordinate) {
    Linear data;
    data.z.col(1).setZero();
    const Eigen::MatrixXf map = take_linear_centre(data.z, data.spheres);
    EXPECT_TRUE(map.allFinite());
    EXPECT_EQ(map.row(1).cwiseAbs().maxCoeff(), 0);
}

TEST(LinearCentre, GivesTheSameBitsOnAnyNumberOfThreads) {
    const Linear data;
    const auto run = [&] {
        PoseRows spheres = data.spheres;
        return take_linear_centre(data.z, spheres);
    };
    EXPECT_EQ(test::on_threads(1, run), test::on_threads(2, run));
}

Eigen::Array4f given(const NbdNetworks& networks, int node, const PoseRows& z, Eigen::Index pose) {
    FixedVector x(z.cols());
    x.numbers() = z.row(pose).transpose();
    x.fix();
    Eigen::Array4f result;
    networks.evaluate(node, x, {&result, 1});
    return result;
}

TEST(RoundNetworks, RemovesTheMeanError) {
    const MlpShape shape{.inputs = 20, .hidden = 16};
    constexpr int nodes = 3, poses = 300;
    Eigen::VectorXf weights(nodes * shape.weights());
    for (int node = 0; node < nodes; ++node)
        weights.segment(node * shape.weights(), shape.weights()) = initial_weights(shape, 5, node);
    std::srand(3);
    const PoseRows z = PoseRows::Random(poses, shape.inputs);
    const PoseRows targets = PoseRows::Random(poses, MlpShape::outputs * nodes).array() + 0.5f;
    const std::span<const float> all(weights.data(), weights.size());
    const NbdNetworks plain(shape.inputs, shape.hidden, all),
        centred = round_networks(shape, all, z, targets);
    for (int node = 0; node < nodes; ++node) {
        Eigen::Array4f before = Eigen::Array4f::Zero(), after = before;
        for (int pose = 0; pose < poses; ++pose) {
            const Eigen::Array4f target = targets.row(pose).segment<4>(4 * node).transpose();
            before += target - given(plain, node, z, pose);
            after += target - given(centred, node, z, pose);
        }
        EXPECT_GT((before / poses).abs().maxCoeff(), 0.1f);
        EXPECT_LT((after / poses).abs().maxCoeff(), 1e-5f);
    }
    // Only the last biases change.
    const std::vector<float> of_plain = plain.weights(), of_centred = centred.weights();
    for (std::size_t i = 0; i < of_plain.size(); ++i)
        if (static_cast<int>(i) % shape.weights() < shape.b3()) {
            EXPECT_EQ(of_plain[i], of_centred[i]);
        }
}

}  // namespace
}  // namespace nbd
