#include "training/networks/radius_network.hpp"

#include <gtest/gtest.h>

#include "collision/base/counter_random.hpp"

namespace nbd {
namespace {

/// Distances of about 2 m and a known growth of a few centimetres.
struct Known {
    PoseRows distances{2000, 16};
    Eigen::VectorXf growth{2000};

    explicit Known(double noise = 0) {
        CounterRandom random(1, 2);
        for (Eigen::Index p = 0; p < distances.rows(); ++p) {
            for (Eigen::Index i = 0; i < 16; ++i)
                distances(p, i) = static_cast<float>(random.uniform(1.9, 2.1));
            growth[p] = 0.03f + 0.2f * std::max(0.f, distances(p, 3) - distances(p, 7)) +
                        static_cast<float>(noise * random.unit());
        }
    }
};

TEST(RadiusNetwork, LearnsAKnownFunction) {
    const Known known;
    for (const int hidden : {16, 32}) {
        const auto trained = train_radius_network(known.distances, known.growth, {.hidden = hidden}, 3);
        const Eigen::VectorXf error = apply_radius_network(trained.weights, known.distances) - known.growth;
        const float deviation = std::sqrt((known.growth.array() - known.growth.mean()).square().mean());
        EXPECT_LT(std::sqrt(error.squaredNorm() / 2000), 0.08f * deviation) << hidden;
        EXPECT_LT(trained.loss, 0.01f) << hidden;
    }
}

TEST(RadiusNetwork, LearnsAQuantileWithPinballLoss) {
    const Known known(0.05);
    for (const double quantile : {0.5, 0.9}) {
        const auto trained = train_radius_network(known.distances, known.growth, {.quantile = quantile}, 3);
        const Eigen::ArrayXf given = apply_radius_network(trained.weights, known.distances);
        const double below = (known.growth.array() <= given).cast<double>().mean();
        EXPECT_NEAR(below, quantile, 0.04);
    }
}

TEST(RadiusNetwork, LearnsAConstantGrowthExactly) {
    Known known;
    known.growth.setConstant(0.07f);
    const auto trained = train_radius_network(known.distances, known.growth, {}, 3);
    EXPECT_TRUE((apply_radius_network(trained.weights, known.distances).array() == 0.07f).all());
}

TEST(RadiusNetwork, IgnoresADistanceThatIsConstantInTraining) {
    Known known;
    known.distances.col(5).setConstant(1.25f);
    const auto trained = train_radius_network(known.distances, known.growth, {.epochs = 5}, 3);
    const Eigen::VectorXf before = apply_radius_network(trained.weights, known.distances);
    known.distances.col(5).setConstant(99);
    EXPECT_EQ(apply_radius_network(trained.weights, known.distances), before);
}

}  // namespace
}  // namespace nbd
