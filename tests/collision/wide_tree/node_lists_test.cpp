#include <gtest/gtest.h>

#include <limits>
#include <random>

#include "collision/wide_tree/affine_parts.hpp"
#include "tests/support/shapes.hpp"

namespace nbd {
namespace {

/// Node numbers as places of first coordinates.
std::vector<std::int32_t> places(std::vector<std::int32_t> nodes) {
    for (std::int32_t& node : nodes) node *= 3;
    return nodes;
}

TEST(NodeLists, AreBoundedWhateverTheirLength) {
    constexpr int count = 10;
    const std::vector<std::vector<std::int32_t>> lists = {places({9}),
                                                          places({0}),
                                                          places({1, 2, 3, 4, 5}),
                                                          places({0, 3, 6, 8, 9}),
                                                          places({2, 4, 6, 8}),
                                                          places({0, 1, 2, 3, 4, 5, 6, 7, 8, 9})};
    const std::vector<std::span<const std::int32_t>> spans(lists.begin(), lists.end());
    const NodeLists node_lists(spans, count);
    std::mt19937 random(1);
    std::vector<float> x(3 * count);  // no number behind it: a sanitizer notices if one is read
    for (float& number : x) number = shapes::uniform(random);
    std::vector<Box> boxes(lists.size());
    EXPECT_TRUE(node_lists.boxes(x.data(), boxes));
    for (std::size_t l = 0; l < lists.size(); ++l) {
        Box expected = empty_box();
        for (const std::int32_t place : lists[l]) {
            const float* p = x.data() + place;
            const Eigen::Array4f point(p[0], p[1], p[2], 0);
            expected = joined(expected, {point, point});
        }
        EXPECT_TRUE((boxes[l].lo == expected.lo).all() && (boxes[l].hi == expected.hi).all()) << l;
    }
    for (float& number : x) {
        const float before = number;
        for (const float wrong :
             {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
            number = wrong;
            EXPECT_FALSE(node_lists.boxes(x.data(), boxes)) << &number - x.data();
        }
        number = before;
    }
}

}  // namespace
}  // namespace nbd
