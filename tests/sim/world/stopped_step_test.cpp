#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <string>
#include <thread>
#include <vector>

#include "collision/base/stop.hpp"
#include "collision/base/stopwatch.hpp"
#include "meshing/body/make_body.hpp"
#include "sim/world/start_check.hpp"
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

class StoppedStep : public ::testing::TestWithParam<bool> {};

TEST_P(StoppedStep, IsTakenBackAndBeginsAgainWithTheSameBits) {
    const Model box({1, 0.4, 0.3}, {6, 3, 2});
    constexpr int steps = 30;
    World undisturbed = two_boxes(box, GetParam());
    int contacts = 0;
    const Stopwatch watch;
    for (int i = 0; i < steps; ++i) contacts += undisturbed.step(5e-3).contacts;
    const double seconds_of_a_step = watch.seconds() / steps;
    ASSERT_GT(contacts, 0);

    // Again until enough steps were stopped after they had begun.
    for (int stops = 0, tries = 0, scenes = 0; stops < 6; ++scenes) {
        ASSERT_LT(scenes, 1000);
        World stopped = two_boxes(box, GetParam());
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
    WorldConfig config;
    config.contact.intersection_free = true;
    World world(config);
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

INSTANTIATE_TEST_SUITE_P(WithAndWithoutIntersections, StoppedStep, ::testing::Bool());

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

/// Boxes of 20 cm, at these places.
std::vector<StartFault> faults_of(const std::vector<Eigen::Vector3d>& centres,
                                  const std::vector<Obstacle>& obstacles = {}) {
    const Model box({0.2, 0.2, 0.2}, {2, 2, 2});
    World world{WorldConfig{}};
    std::vector<std::string> labels;
    for (const Eigen::Vector3d& centre : centres)
        labels.push_back("box " + std::to_string(world.add_body(box.at(centre))));
    for (const Obstacle& obstacle : obstacles) world.add_obstacle(obstacle);
    return start_faults(world, labels);
}

void expect_one(const std::vector<StartFault>& faults, bool overlaps, const std::string& begin) {
    ASSERT_EQ(faults.size(), 1u);
    EXPECT_EQ(faults[0].overlaps, overlaps) << faults[0].text;
    EXPECT_TRUE(faults[0].text.starts_with(begin)) << faults[0].text;
}

Obstacle ball(const Eigen::Vector3d& centre, double radius) {
    return {.shape = BallShape{.centre = centre, .radius = radius}};
}

/// A solid box from `low` to `high`.
Obstacle block(const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
    const Model box(high - low, {2, 2, 2});
    TriMesh mesh = boundary_surface(box.body.tets);
    mesh.X.rowwise() += ((low + high) / 2 - mesh.X.colwise().mean().transpose()).transpose();
    return {.shape = std::make_shared<const StaticSurface>(std::move(mesh))};
}

TEST(StartCheck, FindsNothingBetweenThingsThatAreApart) {
    EXPECT_TRUE(faults_of({{0, 0, 0.11}, {0.201, 0, 0.11}, {0.05, 0.03, 0.3101}}, {floor_at(0)}).empty());
    EXPECT_TRUE(
        faults_of({{0, 0, 0}}, {ball({0, 0, 0.301}, 0.2), block({0.1001, -1, -1}, {1, 1, 1})}).empty());
}

TEST(StartCheck, TellsOverlapFromTouch) {
    expect_one(faults_of({{0, 0, 0}, {0.15, 0.02, 0.03}}), true, "box 1: overlaps box 0 at the start: ");
    expect_one(faults_of({{0, 0, 0}, {0.199, 0.02, 0.03}}), true, "box 1: overlaps box 0 at the start: ");
    expect_one(faults_of({{0, 0, 0}, {0.2, 0, 0}}), false, "box 1: touches box 0 at the start");
    expect_one(faults_of({{0, 0, 0}, {0.05, 0.07, -0.2}}), false, "box 1: touches box 0 at the start");
    // Far from the origin, where single precision knows no millimetre.
    const Eigen::Vector3d far(4e5, 5e6, 0);
    expect_one(faults_of({far, far + Eigen::Vector3d(0.15, 0, 0)}), true, "box 1: overlaps box 0");
    EXPECT_TRUE(faults_of({far, far + Eigen::Vector3d(0.21, 0, 0)}).empty());
}

TEST(StartCheck, FindsBodiesThatCrossWithoutAVertexInside) {
    const Model rod({1, 0.1, 0.1}, {4, 1, 1}), post({0.1, 0.1, 1}, {1, 1, 4});
    World world{WorldConfig{}};
    world.add_body(rod.at({0, 0, 0}));
    world.add_body(post.at({0.013, 0.007, 0.011}));
    expect_one(start_faults(world, {"rod", "post"}), true, "post: overlaps rod at the start: ");
}

TEST(StartCheck, FindsABodyInsideAnother) {
    const Model large({0.5, 0.5, 0.5}, {2, 2, 2}), small({0.1, 0.1, 0.1}, {1, 1, 1});
    World world{WorldConfig{}};
    world.add_body(large.at({0, 0, 0}));
    world.add_body(small.at({0.03, 0.02, 0.01}));
    expect_one(start_faults(world, {"large", "small"}), true,
               "small: lies inside large or encloses it at the start");
}

TEST(StartCheck, FindsBodiesInObstacles) {
    expect_one(faults_of({{0, 0, 0.07}}, {floor_at(0)}), true,
               "box 0: is 0.03 m deep in obstacles[0] at the");
    expect_one(faults_of({{0, 0, 0.1}}, {floor_at(0)}), false, "box 0: touches obstacles[0] at the start");
    expect_one(faults_of({{0, 0, 0.0999}}, {floor_at(0)}), false, "box 0: touches obstacles[0] at the start");
    // A ball that comes through a face between its vertices, one wholly inside, one that touches.
    expect_one(faults_of({{0, 0, 0}}, {ball({0.05, 0.05, 0.13}, 0.04)}), true, "box 0: is 0.01 m deep in");
    expect_one(faults_of({{0, 0, 0}}, {ball({0.01, 0.02, 0}, 0.02)}), true, "box 0: is 0.1 m deep in");
    expect_one(faults_of({{0, 0, 0}}, {ball({0.05, 0.05, 0.14}, 0.04)}), false,
               "box 0: touches obstacles[0]");
    // Meshes: a vertex inside, faces that cross without one, a mesh inside, one that touches.
    expect_one(faults_of({{0, 0, 0}}, {block({0.05, 0.05, -1}, {1, 1, 1})}), true,
               "box 0: is 0.05 m deep in");
    expect_one(faults_of({{0, 0, 0}}, {block({0.02, 0.02, -1}, {0.08, 0.07, 1})}), true,
               "box 0: overlaps obstacles[0] at the start: ");
    expect_one(faults_of({{0, 0, 0}}, {block({-0.03, -0.03, -0.05}, {0.03, 0.02, 0.05})}), true,
               "box 0: encloses obstacles[0] at the start");
    expect_one(faults_of({{0, 0, 0}}, {block({0.1, -1, -1}, {1, 1, 1})}), false,
               "box 0: touches obstacles[0]");
}

TEST(StartCheck, WarnsInOneLine) {
    EXPECT_EQ(start_warning({}, false), "");
    const StartFault fault{true, "b: overlaps a"};
    EXPECT_EQ(start_warning({fault}, false),
              "b: overlaps a; \"resolve_start\": true moves bodies apart before the first step");
    EXPECT_EQ(start_warning({fault, fault, fault, fault, fault}, true),
              "b: overlaps a; b: overlaps a; b: overlaps a; and 2 more, although \"resolve_start\" is set; "
              "place the bodies apart");
    // Overlaps come first.
    const auto faults = faults_of({{0, 0, 0.1}, {1, 0, 0.05}}, {floor_at(0)});
    ASSERT_EQ(faults.size(), 2u);
    EXPECT_TRUE(faults[0].overlaps);
    EXPECT_TRUE(faults[0].text.starts_with("box 1: is 0.05 m deep")) << faults[0].text;
}

}  // namespace
}  // namespace nbd
