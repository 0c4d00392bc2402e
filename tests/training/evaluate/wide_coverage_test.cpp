#include "training/evaluate/wide_coverage.hpp"

#include <gtest/gtest.h>

#include "tests/training/example_tree.hpp"

namespace nbd {
namespace {

/// Bounds are out of range one by one, by limits that only one of them is above.
TEST(WideCoverage, TellsWhichBoundsAreOutOfRange) {
    TreeFile file = test::example_tree({.grid = 128, .depth = 5});
    Calibration& calibration = file.tree.calibrations.at(BoundKind::learned_affine);
    const std::size_t bounds = calibration.limits.size();
    for (const std::size_t chosen : {std::size_t{0}, std::size_t{3}, bounds / 2, bounds - 1}) {
        calibration.limits.assign(bounds, 1e30f);
        calibration.limits[chosen] = -1;
        WideCoverage coverage(file.tree);
        const std::span<const WideOutcome> outcomes = coverage.measure(file.X);
        ASSERT_EQ(outcomes.size(), bounds);
        ASSERT_EQ(outcomes[3].level, 0) << "needs more clusters";
        for (std::size_t i = 0; i < bounds; ++i) EXPECT_EQ(outcomes[i].out_of_range, i == chosen) << i;
    }
}

}  // namespace
}  // namespace nbd
