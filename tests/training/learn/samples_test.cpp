#include "training/learn/samples.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <set>

#include "collision/geometry/bounding_box.hpp"
#include "collision/geometry/positions.hpp"
#include "tests/training/bar.hpp"

namespace nbd {
namespace {

using test::Bar;

struct Samples : testing::Test {
    Bar bar{0, 8};
    std::vector<int> all = numbers(bar.body.X.rows());

    static std::vector<int> numbers(int count) {
        std::vector<int> list(count);
        std::iota(list.begin(), list.end(), 0);
        return list;
    }
    /// Surfaces in the frames of some trajectories.
    std::vector<Vertices> poses(std::uint64_t seed) const {
        std::vector<Vertices> list;
        for (int frame = 0; frame < 40; ++frame)
            apply_embedding(bar.body.W, bar.frame(seed, frame % 4, frame), list.emplace_back());
        return list;
    }
};

TEST_F(Samples, AreDifferentVerticesOfThePatch) {
    const std::vector<Vertices> seen = poses(2);
    const std::vector<int> patch(all.begin() + 40, all.begin() + 140);
    for (const SampleRule rule : {SampleRule::spread, SampleRule::support}) {
        const std::vector<int> samples = choose_samples(bar.body.X, seen, patch, rule, 32);
        EXPECT_EQ(samples.size(), 32u);
        EXPECT_EQ(std::set<int>(samples.begin(), samples.end()).size(), 32u);
        for (const int v : samples) EXPECT_TRUE(v >= 40 && v < 140) << v;
    }
}

TEST_F(Samples, OfASmallPatchAreAllItsVertices) {
    const std::vector<Vertices> seen = poses(2);
    const std::vector<int> patch = {9, 4, 4, 30, 7};
    const std::vector<int> expected = {4, 7, 9, 30, 4, 4, 4, 4, 4, 4, 4, 4, 4, 4, 4, 4};
    for (const SampleRule rule : {SampleRule::spread, SampleRule::support})
        EXPECT_EQ(choose_samples(bar.body.X, seen, patch, rule, 32), expected);
}

TEST_F(Samples, BySupportReachFartherOutInUnseenPoses) {
    const std::vector<Vertices> seen = poses(2);
    const auto protrusion = [&](SampleRule rule) {
        const std::vector<int> samples = choose_samples(bar.body.X, seen, all, rule, 16);
        double sum = 0;
        for (const Vertices& x : poses(99)) {
            const Positions view(x);
            sum += double{outside(bounding_box(view, samples), bounding_box(view, all))};
        }
        return sum;
    };
    const double support = protrusion(SampleRule::support), spread = protrusion(SampleRule::spread);
    EXPECT_GT(spread, 0);
    EXPECT_LT(support, 0.7 * spread);
}

}  // namespace
}  // namespace nbd
