#include "collision/nbd_tree/nbd_networks.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "tests/collision/models.hpp"
#include "tests/support/error_of.hpp"

namespace nbd {
namespace {

Eigen::Array4f evaluated(const NbdNetworks& networks, int i, const FixedVector& x) {
    Eigen::Array4f result;
    networks.evaluate(i, x, {&result, 1});
    return result;
}

std::vector<float> random_weights(int count, unsigned seed) {
    std::mt19937 random(seed);
    std::vector<float> weights(count);
    for (float& w : weights) w = shapes::uniform(random) * std::exp(3 * shapes::uniform(random));
    return weights;
}

TEST(NbdNetworks, RoundEachRowToEightBitsOfItsLargestWeight) {
    const int inputs = 5, hidden = 3;
    const std::vector<float> weights = random_weights(2 * NbdNetworks::weight_count(inputs, hidden), 1);
    const NbdNetworks networks(inputs, hidden, weights);
    const std::vector<float> rounded = networks.weights();
    ASSERT_EQ(networks.count(), 2);
    ASSERT_EQ(rounded.size(), weights.size());
    const Eigen::Map<const Eigen::MatrixXf> W1(weights.data(), hidden, inputs),
        R1(rounded.data(), hidden, inputs);
    for (int o = 0; o < hidden; ++o)
        EXPECT_LE((W1.row(o) - R1.row(o)).cwiseAbs().maxCoeff(), W1.row(o).cwiseAbs().maxCoeff() / 253);
    for (int o = 0; o < hidden; ++o) EXPECT_EQ(rounded[15 + o], weights[15 + o]);  // b1
}

TEST(NbdNetworks, RoundOnlyOnce) {
    for (const int inputs : {1, 5, 128, 200})
        for (const int hidden : {1, 16, 33}) {
            const NbdNetworks networks(inputs, hidden,
                                       random_weights(3 * NbdNetworks::weight_count(inputs, hidden), 2));
            const std::vector<float> rounded = networks.weights();
            EXPECT_EQ(NbdNetworks(inputs, hidden, rounded).weights(), rounded);
        }
}

TEST(NbdNetworks, DoNotOverflowForTheLargestWeightsAndInputs) {
    const int inputs = NbdNetworks::max_inputs, hidden = 1;
    std::vector<float> weights(NbdNetworks::weight_count(inputs, hidden), 0.f);
    weights[static_cast<std::size_t>(inputs) + 1] = 1;  // W2
    weights[static_cast<std::size_t>(inputs) + 3] = 1;  // W3, first output
    const float most = 1.99999f;                        // rounds to the largest fixed-point number
    EXPECT_EQ(shapes::fixed(Eigen::VectorXf::Constant(inputs, most)).fixed()[0], Kernels::max_fixed);
    for (const float sign : {1.f, -1.f}) {
        std::fill_n(weights.begin(), inputs, sign * 127.f);  // W1
        const NbdNetworks network(inputs, hidden, weights);
        const Eigen::Array4f o = evaluated(network, 0,
                                           shapes::fixed(Eigen::VectorXf::Constant(inputs, sign * most))),
                             none = evaluated(network, 0,
                                              shapes::fixed(Eigen::VectorXf::Constant(inputs, -sign * most)));
        EXPECT_NEAR(o[0], 2 * 127.f * static_cast<float>(inputs), 2000);
        EXPECT_EQ(o[1], 0);
        EXPECT_EQ(none[0], 0);
    }
}

TEST(NbdNetworks, GiveTheSameResultsAloneAndInGroups) {
    for (const int hidden : {1, 16, 33, 128}) {
        const NbdNetworks networks(20, hidden, random_weights(5 * NbdNetworks::weight_count(20, hidden), 4));
        const FixedVector x = shapes::fixed(Eigen::VectorXf::LinSpaced(20, -0.7f, 1.2f));
        std::array<Eigen::Array4f, NbdNetworks::max_at_once> together;
        for (int first = 0; first + NbdNetworks::max_at_once <= 5; ++first) {
            networks.evaluate(first, x, together);
            for (int i = 0; i < NbdNetworks::max_at_once; ++i)
                EXPECT_TRUE((together[i] == evaluated(networks, first + i, x)).all());
        }
    }
}

TEST(NbdNetworks, GiveNanForNonFiniteInputs) {
    for (const NetworkNumbers numbers : {NetworkNumbers::bytes, NetworkNumbers::floats}) {
        const NbdNetworks network(3, 2, random_weights(NbdNetworks::weight_count(3, 2), 3), numbers);
        for (const float bad : {NAN, INFINITY})
            EXPECT_TRUE(evaluated(network, 0, shapes::fixed(Eigen::Vector3f(0, bad, 1))).isNaN().all());
    }
}

TEST(NbdNetworks, KeepFloatsAsTheyAre) {
    const int inputs = 70, hidden = 33, nodes = 3;
    const std::vector<float> weights = random_weights(nodes * NbdNetworks::weight_count(inputs, hidden), 5);
    const NbdNetworks bytes(inputs, hidden, weights), floats(inputs, hidden, weights, NetworkNumbers::floats);
    EXPECT_NE(bytes.weights(), weights);
    EXPECT_EQ(floats.weights(), weights);

    const Eigen::VectorXf x = Eigen::VectorXf::LinSpaced(inputs, -0.7f, 0.9f);
    for (int node = 0; node < nodes; ++node) {
        const float* next = weights.data() + node * floats.weight_count();
        Eigen::VectorXd values = x.cast<double>();
        for (const int out : {hidden, hidden, NbdNetworks::outputs}) {
            const Eigen::Map<const Eigen::MatrixXf> W(next, out, values.size());
            const Eigen::Map<const Eigen::VectorXf> b(next + W.size(), out);
            next += W.size() + b.size();
            values = (W.cast<double>() * values + b.cast<double>()).eval();
            if (out == hidden) values = values.cwiseMax(0);
        }
        const double size = values.cwiseAbs().maxCoeff();
        const auto error = [&](const NbdNetworks& networks) {
            return (evaluated(networks, node, shapes::fixed(x)).matrix().cast<double>() - values).norm() /
                   size;
        };
        EXPECT_LT(error(floats), 1e-5);
        EXPECT_GT(error(bytes), 1e-4);
    }
}

TEST(NbdNetworks, RejectInvalidSizesAndWeights) {
    const auto error = [](int inputs, int hidden, std::vector<float> weights) {
        return test::refusal([&] { NbdNetworks(inputs, hidden, weights); });
    };
    EXPECT_EQ(error(0, 1, {}), "NBD-Tree: 0 inputs, allowed: 1 to 1024");
    EXPECT_EQ(error(1025, 1, {}), "NBD-Tree: 1025 inputs, allowed: 1 to 1024");
    EXPECT_EQ(error(3, 129, {}), "NBD-Tree: hidden width 129, allowed: 1 to 128");
    EXPECT_EQ(error(1, 1, std::vector<float>(13)), "NBD-Tree: 13 weights, allowed: multiples of 12");
    std::vector<float> weights(36);
    EXPECT_EQ(error(1, 1, weights), "");
    weights[20] = NAN;
    EXPECT_EQ(error(1, 1, weights), "NBD-Tree: a weight of node 1 is not finite");
}

}  // namespace
}  // namespace nbd
