#include "training/networks/round_networks.hpp"

#include <gtest/gtest.h>

#include <cstdlib>

namespace nbd {
namespace {

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
        weights.segment(node * shape.weights(), shape.weights()) =
            initial_weights(shape, 5, static_cast<std::uint64_t>(node));
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
