#include "sim/barrier/barrier_law.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace nbd {
namespace {

constexpr BarrierLaw law{.reach = 0.02, .floor = 0.002, .stiffness = 300};

TEST(BarrierLaw, HasTheDerivativesThatItStates) {
    for (double d = 0.003; d < law.reach; d += 0.001) {
        const double h = 1e-7;
        const auto at = law.at(d), less = law.at(d - h), more = law.at(d + h);
        EXPECT_NEAR(at.slope, (more.energy - less.energy) / (2 * h), 1e-6 * std::abs(at.slope) + 1e-9) << d;
        EXPECT_NEAR(at.curvature, (more.slope - less.slope) / (2 * h), 1e-6 * at.curvature + 1e-6) << d;
        EXPECT_LT(at.slope, 0) << d;
        EXPECT_GT(at.curvature, 0) << d;
    }
}

TEST(BarrierLaw, BeginsSmoothlyAtItsReach) {
    EXPECT_EQ(law.at(law.reach).energy, 0);
    EXPECT_EQ(law.at(1).slope, 0);
    const auto near = law.at(law.reach - 1e-9);
    EXPECT_LT(near.energy, 1e-20);
    EXPECT_LT(std::abs(near.slope), 1e-11);
    EXPECT_LT(near.curvature, 1e-3);
}

TEST(BarrierLaw, IsInfiniteAtItsFloor) {
    EXPECT_GT(law.at(law.floor * (1 + 1e-9)).energy, 1);
    EXPECT_TRUE(std::isinf(law.at(law.floor).energy));
    EXPECT_TRUE(std::isinf(law.at(0).energy));
}

}  // namespace
}  // namespace nbd
