#include "collision/query/sweep.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

namespace nbd {
namespace {

TEST(Sweep, AgreesWithBruteForce) {
    std::mt19937 random(3);
    const auto draw = [&](float least, float most) {
        return least + (most - least) * static_cast<float>(random() % 4096) / 4096;
    };
    std::size_t touching = 0, apart = 0;
    Sweep sweep;
    for (int round = 0; round < 20; ++round) {
        std::vector<Box> boxes;
        for (int i = 0; i < 40; ++i) {
            const Eigen::Array4f lo(draw(0, 4), draw(0, 1), draw(0, 2), 0);
            const Eigen::Array4f size(draw(0, 1), draw(0, 1), draw(0, 1), 0);
            boxes.push_back(i % 9 == 4 ? empty_box() : Box{lo, lo + size});
        }
        std::vector<BodyIndices> expected;
        for (int a = 0; a < 40; ++a)
            for (int b = a + 1; b < 40; ++b) {
                const Box &s = boxes[a], &t = boxes[b];
                const bool touch = a % 9 != 4 && b % 9 != 4 && (s.lo <= t.hi).all() && (t.lo <= s.hi).all();
                if (touch) expected.push_back({a, b});
                ++(touch ? touching : apart);
            }
        EXPECT_TRUE(std::ranges::equal(sweep.touching(boxes), expected));
    }
    EXPECT_GT(touching, 500u);
    EXPECT_GT(apart, 500u);
}

TEST(Sweep, CountsBoxesThatShareAFace) {
    const Box left{{0, 0, 0, 0}, {1, 1, 1, 0}}, right{{1, 0, 0, 0}, {2, 1, 1, 0}};
    Sweep sweep;
    const auto pairs = sweep.touching(std::vector{right, left});
    ASSERT_EQ(pairs.size(), 1u);
    EXPECT_EQ(pairs[0], (BodyIndices{0, 1}));
    EXPECT_TRUE(sweep.touching({}).empty());
}

}  // namespace
}  // namespace nbd
