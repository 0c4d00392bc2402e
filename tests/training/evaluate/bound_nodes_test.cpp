#include "training/evaluate/bound_nodes.hpp"

#include <gtest/gtest.h>

#include "tests/training/example_tree.hpp"

namespace nbd {
namespace {

/// Bounds are out of range one by one, by limits that only one of them is above.
TEST(BoundNodes, TellWhichBoundsAreOutOfRange) {
    TreeFile file = test::example_tree({.grid = 128, .depth = 5});
    Calibration& calibration = file.tree.calibrations.at(BoundKind::learned_affine);
    const int bounds = calibration.limits.size();
    for (const int chosen : {0, 3, bounds / 2, bounds - 1}) {
        calibration.limits.assign(bounds, 1e30f);
        calibration.limits[chosen] = 0;
        const auto nodes = bound_nodes(refer_to(file.tree), BoundKind::learned_affine, {});
        int last = -1, levels_of_third = -1;
        for (const BoundNode& node : nodes->pose(file.X, {})) {
            EXPECT_EQ(node.out_of_range, node.bound == chosen) << node.bound;
            EXPECT_TRUE(node.bound == last || node.bound == last + 1);
            last = node.bound;
            if (last == 3) levels_of_third = node.level;
        }
        EXPECT_EQ(last + 1, bounds);
        ASSERT_EQ(levels_of_third, 0) << "needs more clusters";
    }
}

}  // namespace
}  // namespace nbd
