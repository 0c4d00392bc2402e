#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <thread>

#include "collision/base/stop.hpp"
#include "sim/world/world.hpp"
#include "tests/sim/world/box_model.hpp"

namespace nbd {
namespace {

using test::floor_at;
using test::Model;

/// Two boxes of which one falls onto the other, with several linearisations and contacts in each step.
World two_boxes(const Model& box, bool intersection_free) {
    WorldConfig config;
    config.contact.intersection_free = intersection_free;
    config.contact.thickness = 0.01;
    config.step.newton_iterations = 8;
    World world(config);
    world.add_obstacle(floor_at(0));
    world.add_body(box.at({0, 0, 0.18}));
    world.add_body(box.at({0.05, 0.03, 0.52}));
    return world;
}

class StoppedStep : public ::testing::TestWithParam<bool> {};

TEST_P(StoppedStep, IsTakenBackAndBeginsAgainWithTheSameBits) {
    const Model box({1, 0.4, 0.3}, {6, 3, 2});
    constexpr int steps = 30;
    World undisturbed = two_boxes(box, GetParam()), stopped = two_boxes(box, GetParam());
    int contacts = 0;
    for (int i = 0; i < steps; ++i) contacts += undisturbed.step(5e-3).contacts;
    ASSERT_GT(contacts, 0);

    std::atomic<bool> asked = false, done = false;
    std::thread asks([&] {
        for (int i = 0; !done; i = (i + 7) % 50) {
            std::this_thread::sleep_for(std::chrono::microseconds(100 * i));
            asked = true;
        }
    });
    const std::atomic<bool> never = false;
    int stops = 0, tries = 0;
    for (int i = 0; i < steps;) {
        const double time = stopped.time();
        const Nodes x = stopped.state(1).x, v = stopped.state(1).v;
        try {
            const StopScope scope(tries++ < 3 ? asked : never);  // so that every step comes to its end
            stopped.step(5e-3);
            tries = 0;
            ++i;
        } catch (const StopAsked&) {
            asked = false;
            ++stops;
            EXPECT_EQ(stopped.time(), time);
            EXPECT_EQ(stopped.state(1).x, x);
            EXPECT_EQ(stopped.state(1).v, v);
            EXPECT_TRUE(stopped.contact_forces(1).isZero(0));
        }
    }
    done = true;
    asks.join();
    EXPECT_GT(stops, 5);
    for (int b = 0; b < 2; ++b) {
        EXPECT_EQ(stopped.state(b).x, undisturbed.state(b).x);
        EXPECT_EQ(stopped.state(b).v, undisturbed.state(b).v);
    }
}

TEST(StoppedDrive, LeavesDrivenNodesToTheNextStep) {
    const Model box({1, 0.4, 0.3}, {6, 3, 2});
    World world((WorldConfig()));
    world.add_body(box.at({0, 0, 0}));
    const std::vector<int> nodes{0, 1, 2};
    const Nodes targets = world.state(0).x(nodes, Eigen::all).array() + 0.01;
    world.drive(0, nodes, targets);
    const std::atomic<bool> asked = true;
    EXPECT_THROW(
        {
            const StopScope scope(asked);
            world.step(0.02);
        },
        StopAsked);
    ASSERT_EQ(world.step(0.01).failure, "");
    EXPECT_LT((world.state(0).x(nodes, Eigen::all) - targets).cwiseAbs().maxCoeff(), 1e-12);
}

TEST(StoppedStart, LeavesBodiesWhereTheyWere) {
    const Model box({0.4, 0.4, 0.4}, {2, 2, 2});
    WorldConfig config;
    config.contact.intersection_free = true;
    World world(config);
    world.add_obstacle(floor_at(-0.15));
    for (int b = 0; b < 4; ++b) world.add_body(box.at({0.3 * b, 0.1 * b, 0.02 * b}));
    const Nodes before = world.state(3).x;
    std::atomic<bool> asked = false;
    int stops = 0;
    for (int wait_us = 0; wait_us < 4000; wait_us += 200) {
        asked = false;
        std::thread asks([&] {
            std::this_thread::sleep_for(std::chrono::microseconds(wait_us));
            asked = true;
        });
        const WorldSnapshot start = world.snapshot();
        try {
            const StopScope scope(asked);
            world.resolve_start();
            world.restore(start);
        } catch (const StopAsked&) {
            ++stops;
        }
        asks.join();
        ASSERT_EQ(world.state(3).x, before) << wait_us;
    }
    EXPECT_GT(stops, 0);
}

INSTANTIATE_TEST_SUITE_P(WithAndWithoutIntersections, StoppedStep, ::testing::Bool());

TEST(StopScope, TheInnermostOfAThreadCounts) {
    std::atomic<bool> yes = true, no = false;
    EXPECT_FALSE(stop_asked());
    {
        const StopScope outer(yes);
        EXPECT_THROW(stop_if_asked(), StopAsked);
        {
            const StopScope inner(no);
            EXPECT_NO_THROW(stop_if_asked());
        }
        EXPECT_TRUE(stop_asked());
        std::thread([] { EXPECT_FALSE(stop_asked()); }).join();
    }
    EXPECT_NO_THROW(stop_if_asked());
}

}  // namespace
}  // namespace nbd
