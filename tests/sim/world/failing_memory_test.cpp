// Memory that runs out in the midst of a step: the step is taken back.
#include <gtest/gtest.h>

#include <cstdlib>
#include <new>
#include <utility>

#include "sim/world/world.hpp"
#include "tests/sim/world/box_model.hpp"

namespace {

thread_local long left = -1;  // blocks that this thread may still ask for; < 0: any number

void* block_of(std::size_t size) {
    if (left == 0) throw std::bad_alloc();
    if (left > 0) --left;
    if (void* block = std::malloc(size > 0 ? size : 1)) return block;
    throw std::bad_alloc();
}

}  // namespace

void* operator new(std::size_t size) { return block_of(size); }
void operator delete(void* block) noexcept { std::free(block); }
void operator delete(void* block, std::size_t) noexcept { std::free(block); }

namespace nbd {
namespace {

/// A box that a sphere is shot at, so fast that a step is cut into parts.
World shot_at() {
    const test::Model box({0.4, 0.4, 0.4}, {4, 4, 4});
    World world(WorldConfig{});
    world.add_obstacle({.shape = BallShape{{-0.35, 0, 0}, 0.1}, .motion = travel({40, 0, 0})});
    world.add_body(box.at({0, 0, 0}, Eigen::Matrix3d::Identity(), {0, 0, 0.1}));
    return world;
}

TEST(FailingMemory, TakesBackAllPartsOfAStep) {
    constexpr double dt = 4e-3;
    World undisturbed = shot_at();
    const WorldReport expected = undisturbed.step(dt);
    ASSERT_EQ(expected.failure, "");
    ASSERT_GT(expected.substeps, 1);
    int thrown = 0;
    double last_share = 0;  // of a step's blocks, at which memory ran out
    for (long blocks = 0;; blocks += 1 + blocks / 8) {
        World world = shot_at();
        const BodyState start = world.state(0);
        bool failed = false;
        try {
            left = blocks;
            world.step(dt);
            left = -1;
        } catch (const std::bad_alloc&) {
            left = -1;
            failed = true;
        }
        if (!failed) break;
        ++thrown;
        last_share = static_cast<double>(blocks);
        ASSERT_EQ(world.time(), 0) << blocks;
        ASSERT_EQ(world.state(0).x, start.x) << blocks;
        ASSERT_EQ(world.state(0).v, start.v) << blocks;
        ASSERT_TRUE(world.contact_forces(0).isZero(0)) << blocks;
        ASSERT_EQ(world.step(dt).failure, "") << blocks;
        EXPECT_EQ(world.state(0).x, undisturbed.state(0).x) << blocks;
    }
    EXPECT_GT(thrown, 20);
    EXPECT_GT(last_share, 1000);
}

}  // namespace
}  // namespace nbd
