#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <string>
#include <thread>
#include <vector>

#include "collision/base/stop.hpp"
#include "collision/base/stopwatch.hpp"
#include "sim/world/world.hpp"
#include "tests/sim/world/box_model.hpp"

namespace nbd {
namespace {

using test::floor_at;
using test::Model;

/// Two boxes of which one falls onto the other, with several linearisations and contacts in each step.
World two_boxes(const Model& box) {
    WorldConfig config;
    config.contact.thickness = 0.01;
    config.step.newton_iterations = 8;
    World world(config);
    world.add_obstacle(floor_at(0));
    world.add_body(box.at({0, 0, 0.18}));
    world.add_body(box.at({0.05, 0.03, 0.52}));
    return world;
}

/// Sets a flag after a share of the time that the same work took before, so that it comes in the midst of the
/// work on machines of any speed.
class Asking {
 public:
    Asking(std::atomic<bool>& asked, double seconds)
        : thread_([&asked, seconds] {
              std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
              asked = true;
          }) {}
    ~Asking() { thread_.join(); }
    Asking(const Asking&) = delete;
    Asking& operator=(const Asking&) = delete;

 private:
    std::thread thread_;
};

TEST(StoppedStep, IsTakenBackAndBeginsAgainWithTheSameBits) {
    const Model box({1, 0.4, 0.3}, {6, 3, 2});
    constexpr int steps = 30;
    World undisturbed = two_boxes(box);
    int contacts = 0;
    const Stopwatch watch;
    for (int i = 0; i < steps; ++i) contacts += undisturbed.step(5e-3).contacts;
    const double seconds_of_a_step = watch.seconds() / steps;
    ASSERT_GT(contacts, 0);

    // Again until enough steps were stopped after they had begun.
    for (int stops = 0, tries = 0, scenes = 0; stops < 6; ++scenes) {
        ASSERT_LT(scenes, 1000);
        World stopped = two_boxes(box);
        for (int i = 0; i < steps;) {
            const double time = stopped.time();
            const Nodes x = stopped.state(1).x, v = stopped.state(1).v;
            std::atomic<bool> asked = false;
            try {
                if (i % 3 == 0 && tries < 20) {  // so that every step comes to its end
                    const Asking asks(asked, seconds_of_a_step * (++tries % 5) / 5);
                    const StopScope scope([&] { return asked.load(); });
                    stopped.step(5e-3);
                } else {
                    stopped.step(5e-3);
                }
                tries = 0;
                ++i;
            } catch (const StopAsked&) {
                stops += tries % 5 > 0;
                EXPECT_EQ(stopped.time(), time);
                EXPECT_EQ(stopped.state(1).x, x);
                EXPECT_EQ(stopped.state(1).v, v);
                EXPECT_TRUE(stopped.contact_forces(1).isZero(0));
            }
        }
        for (int b = 0; b < 2; ++b) {
            EXPECT_EQ(stopped.state(b).x, undisturbed.state(b).x);
            EXPECT_EQ(stopped.state(b).v, undisturbed.state(b).v);
        }
    }
}

TEST(StoppedDrive, LeavesDrivenNodesToTheNextStep) {
    const Model box({1, 0.4, 0.3}, {6, 3, 2});
    World world((WorldConfig()));
    world.add_body(box.at({0, 0, 0}));
    const std::vector<int> nodes{0, 1, 2};
    const Nodes targets = world.state(0).x(nodes, Eigen::all).array() + 0.01;
    world.drive(0, nodes, targets);
    EXPECT_THROW(
        {
            const StopScope scope([] { return true; });
            world.step(0.02);
        },
        StopAsked);
    ASSERT_EQ(world.step(0.01).failure, "");
    EXPECT_LT((world.state(0).x(nodes, Eigen::all) - targets).cwiseAbs().maxCoeff(), 1e-12);
}

TEST(StoppedStart, LeavesBodiesWhereTheyWere) {
    const Model box({0.4, 0.4, 0.4}, {2, 2, 2});
    World world(WorldConfig{});
    world.add_obstacle(floor_at(-0.15));
    for (int b = 0; b < 4; ++b) world.add_body(box.at({0.3 * b, 0.1 * b, 0.02 * b}));
    const Nodes before = world.state(3).x;
    const WorldSnapshot start = world.snapshot();
    const Stopwatch watch;
    world.resolve_start();
    const double seconds = watch.seconds();
    world.restore(start);
    ASSERT_EQ(world.state(3).x, before);
    // Again until it was stopped often enough after it had begun.
    for (int stops = 0, tries = 0; stops < 5; ++tries) {
        ASSERT_LT(tries, 10000);
        std::atomic<bool> asked = tries == 0;
        try {
            const Asking asks(asked, seconds * (tries % 20) / 20);
            const StopScope scope([&] { return asked.load(); });
            world.resolve_start();
            world.restore(start);
        } catch (const StopAsked&) {
            stops += tries > 0;
        }
        ASSERT_EQ(world.state(3).x, before) << tries;
    }
}

TEST(StopScope, TheInnermostOfAThreadCounts) {
    EXPECT_FALSE(stop_asked());
    {
        const StopScope outer([] { return true; });
        EXPECT_THROW(stop_if_asked(), StopAsked);
        {
            const StopScope inner([] { return false; });
            EXPECT_NO_THROW(stop_if_asked());
        }
        EXPECT_TRUE(stop_asked());
        std::thread([] { EXPECT_FALSE(stop_asked()); }).join();
    }
    EXPECT_NO_THROW(stop_if_asked());
}

}  // namespace
}  // namespace nbd
