#include "training/networks/adam.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace nbd {
namespace {

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

}  // namespace
}  // namespace nbd
