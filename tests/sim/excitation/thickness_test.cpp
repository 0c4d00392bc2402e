#include "sim/excitation/thickness.hpp"

#include <gtest/gtest.h>

#include "sim/excitation/recipe.hpp"
#include "tests/support/box_body.hpp"

namespace nbd {
namespace {

double sturdiness(const Eigen::Vector3d& size, const Eigen::Vector3i& cells, const Material& material = {}) {
    const Body body = test::box_body(size, cells, material);
    return natural_scales(body, LocalThickness(body.tets)).sturdiness;
}

TEST(LocalThickness, IsTheDiameterOfARodAndTwiceTheThicknessOfAPlate) {
    const LocalThickness rod(test::box_body({4, 0.1, 0.1}, {80, 2, 2}).tets);
    EXPECT_NEAR(rod.at({0, 0, 0}, 0.5), 0.1, 0.01);
    const LocalThickness plate(test::box_body({2, 2, 0.05}, {40, 40, 1}).tets);
    EXPECT_NEAR(plate.at({0, 0, 0}, 0.5), 0.1, 0.01);
    EXPECT_NEAR(plate.volume({0, 0, 0}, 0.5), 3.14 * 0.25 * 0.05, 0.003);
    EXPECT_TRUE(std::isinf(LocalThickness(test::box_body({1, 1, 1}, {8, 8, 8}).tets).at({0, 0, 0}, 0.2)));
}

TEST(Sturdiness, DependsOnlyOnTheRelativeThicknessOfLimbs) {
    EXPECT_EQ(sturdiness({1, 1, 1}, {4, 4, 4}), 1);
    EXPECT_EQ(sturdiness({1, 0.3, 0.25}, {6, 2, 2}), 1);
    const double thin = sturdiness({1, 0.05, 0.05}, {40, 2, 2});
    const double thinner = sturdiness({1, 0.025, 0.025}, {80, 2, 2});
    EXPECT_NEAR(thin, 0.5, 0.1);
    EXPECT_NEAR(thinner, thin / 2, 0.05);
    EXPECT_NEAR(sturdiness({100, 5, 5}, {40, 2, 2}, {.young = 1e9, .density = 7800}), thin, 1e-9);
}

}  // namespace
}  // namespace nbd
