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
