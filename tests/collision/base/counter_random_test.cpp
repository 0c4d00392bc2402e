#include "collision/base/counter_random.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace nbd {
namespace {

TEST(CounterRandom, KeepsTheBitsOnWhichFilesDepend) {
    CounterRandom random(1, 2);
    EXPECT_EQ(random.bits(), 0xc2c354894ca58872u);
    EXPECT_EQ(random.bits(), 0xd08b293d0d3a28d9u);
    EXPECT_EQ(counter_random(1, 2, 0), 0x12dc053355a94bdu);
    EXPECT_EQ(counter_random(1, 2, 1), 0x1b637ea80b3012bbu);
}

TEST(CounterRandom, GivesEqualBitsForEqualCountersAndDifferentBitsOtherwise) {
    CounterRandom a(1, 2), b(1, 2), other_stream(1, 3), other_seed(2, 2);
    for (int i = 0; i < 100; ++i) {
        const auto bits = a.bits();
        EXPECT_EQ(bits, b.bits());
        EXPECT_NE(bits, other_stream.bits());
        EXPECT_NE(bits, other_seed.bits());
    }
}

TEST(CounterRandom, FillsItsRangesEvenly) {
    CounterRandom random(3, 0);
    double sum = 0;
    Eigen::Vector3d directions = Eigen::Vector3d::Zero();
    std::vector<int> hits(5);
    for (int i = 0; i < 20000; ++i) {
        const double u = random.uniform(2, 4);
        ASSERT_TRUE(u >= 2 && u < 4);
        sum += u;
        directions += random.direction();
        ++hits.at(random.index(5));
        ASSERT_NEAR(random.orientation().norm(), 1, 1e-12);
    }
    EXPECT_NEAR(sum / 20000, 3, 0.02);
    EXPECT_LT(directions.norm() / 20000, 0.02);
    for (const int count : hits) EXPECT_NEAR(count, 4000, 300);
}

}  // namespace
}  // namespace nbd
