#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "meshing/body/rigid_body.hpp"
#include "sim/world/grip.hpp"
#include "sim/world/world.hpp"
#include "tests/meshing/shapes.hpp"
#include "tests/sim/world/box_model.hpp"
#include "tests/support/error_of.hpp"

namespace nbd {
namespace {

using test::floor_at;
using test::Model;

// Steps that were kept although something went wrong say so.

/// Reports of a box that falls on a floor.
std::vector<WorldReport> drop(const WorldConfig& config, double speed) {
    const Model box({0.4, 0.4, 0.4}, {3, 3, 3});
    World world(config);
    world.add_obstacle(floor_at(0, 0.5));
    WorldBody body = box.at({0, 0, 0.25});
    body.state.v.col(2).setConstant(-speed);
    world.add_body(std::move(body));
    std::vector<WorldReport> reports;
    for (int i = 0; i < 30; ++i) reports.push_back(world.step(5e-3));
    return reports;
}

TEST(StepTrouble, AnOrdinaryImpactHasNone) {
    for (const WorldReport& report : drop({}, 2)) {
        EXPECT_EQ(report.trouble, StepTrouble::none) << report.trouble_reason;
        EXPECT_EQ(report.trouble_reason, "");
    }
}

TEST(StepTrouble, AnIterationThatCannotReachItsToleranceIsTold) {
    WorldConfig config;
    config.step.newton_iterations = 10;
    config.step.newton_tolerance = 1e-12;
    int told = 0;
    for (const WorldReport& report : drop(config, 2)) {
        EXPECT_EQ(report.failure, "");
        told += report.trouble == StepTrouble::newton;
        EXPECT_EQ(report.trouble == StepTrouble::none, report.trouble_reason.empty());
        if (report.trouble == StepTrouble::newton) {
            EXPECT_NE(report.trouble_reason.find("Newton's iteration ends"), std::string::npos);
            EXPECT_EQ(report.substeps, config.step.max_substeps);
        }
    }
    EXPECT_GT(told, 10);
}

/// The report of a step in which a grip moves the whole box by `way` at once, beside another box at `there`,
/// which jumps as well if `together`.
WorldReport jump(const Eigen::Vector3d& way, const Eigen::Vector3d& there, bool together = false) {
    const Model box({0.4, 0.4, 0.4}, {2, 2, 2});
    World world(WorldConfig{.gravity = Eigen::Vector3d::Zero()});
    Grip grip{.motion = eased({.translation = way})};
    for (int i = 0; i < box.elastic->node_count(); ++i) grip.nodes.push_back(i);
    WorldBody body = box.at({0, 0, 1}), other = box.at(there);
    body.grips = {grip};
    if (together) other.grips = {grip};
    world.add_body(std::move(body));
    world.add_body(std::move(other));
    return world.step(5e-3);
}

TEST(StepTrouble, AGripThatPushesABodyAwayAtOnceTellsHowFarItComes) {
    const std::string all = jump({0, 0, -2}, {0, 0, 0}, true).failure;
    EXPECT_EQ(all, "") << "both jump";
    EXPECT_EQ(jump({0, 0, -2}, {1, 0, 0}).failure, "") << "jumps beside it";
    EXPECT_EQ(jump({0, 0, 2}, {0, 0, 0}).failure, "") << "jumps away";
    const WorldReport through = jump({0, 0, -2}, {0, 0, 0});
    EXPECT_TRUE(through.failure.empty()
                    ? through.least_distance > 0
                    : through.failure.find("without an intersection") != std::string::npos)
        << through.failure;
}

/// Reports of a sphere that flies at a box, in steps that are cut into at most `most` parts.
std::vector<WorldReport> shoot_sphere(int most, const Eigen::Vector3d& from, double speed) {
    const Model box({0.4, 0.4, 0.4}, {4, 4, 4});
    WorldConfig config{.gravity = Eigen::Vector3d::Zero()};
    config.step.max_substeps = most;
    World world(config);
    world.add_obstacle({.shape = BallShape{from, 0.1}, .motion = travel({speed, 0, 0})});
    world.add_body(box.at({0, 0, 0}));
    std::vector<WorldReport> reports;
    while (world.time() < 0.8 / speed && (reports.empty() || reports.back().failure.empty()))
        reports.push_back(world.step(5e-3));
    return reports;
}

TEST(StepTrouble, ASphereThatMayPassVerticesInAStepIsTold) {
    const auto told = [](const std::vector<WorldReport>& reports) {
        return std::ranges::count(reports, StepTrouble::approach, &WorldReport::trouble);
    };
    const std::vector<WorldReport> fast = shoot_sphere(1, {-0.6, 0, 0}, 50);
    ASSERT_GT(told(fast), 0);
    const auto first = std::ranges::find(fast, StepTrouble::approach, &WorldReport::trouble);
    EXPECT_NE(first->trouble_reason.find("body 0 and the sphere obstacles[0] may approach each other by "
                                         "0.25 m in a step, allowed: its radius, 0.1"),
              std::string::npos)
        << first->trouble_reason;
    EXPECT_EQ(told(shoot_sphere(8, {-0.6, 0, 0}, 50)), 0) << "parts are short enough";
    EXPECT_EQ(told(shoot_sphere(1, {-0.6, 0, 0}, 15)), 0) << "steps are short enough";
    EXPECT_EQ(told(shoot_sphere(1, {-0.6, 0.5, 0}, 50)), 0) << "passes beside the box";
}

/// Where some contacts let go because friction pulls, and press again without it, passes used to alternate.
TEST(StepTrouble, PassesSettleTheContactsOfAHeap) {
    const Model box({0.1, 0.1, 0.1}, {2, 2, 2});
    World world{WorldConfig{}};
    world.add_obstacle(floor_at(0, 0.5));
    for (int i = 0; i < 27; ++i) {
        const Eigen::Vector3d centre = 0.18 * Eigen::Vector3d(i % 3 + 0.3 * (i / 9), i / 3 % 3, i / 9 + 0.6);
        world.add_body(box.at(centre, test::turned(0.7 * i), {0, 0, -1}));
    }
    int contacts = 0;
    for (int i = 0; i < 40; ++i) {
        const WorldReport report = world.step(5e-3);
        EXPECT_EQ(report.trouble, StepTrouble::none) << report.trouble_reason;
        contacts = std::max(contacts, report.contacts);
    }
    EXPECT_GT(contacts, 100);
}

TEST(StepTrouble, TetrahedraInsideOutAreTold) {
    const Model box({0.4, 0.4, 0.4}, {3, 3, 3});
    World world(WorldConfig{.gravity = Eigen::Vector3d::Zero()});
    WorldBody body = box.at({0, 0, 0});
    body.state.x.col(2) *= -1;  // a mirror image, which a short step cannot turn back
    world.add_body(std::move(body));
    const WorldReport report = world.step(1e-5);
    EXPECT_EQ(report.inverted_elements, box.elastic->element_count());
    EXPECT_EQ(report.trouble, StepTrouble::inverted);
    EXPECT_EQ(report.trouble_reason, "at 1e-05 s: 162 tetrahedra are inside out");
    EXPECT_TRUE(spoils_pose(report.trouble));
    EXPECT_EQ(report.failure, "");
}

/// The second of two bodies is torn apart in a step.
TEST(StepTrouble, AFailureLeavesTheEnergyOfTheBodiesBeforeIt) {
    const Model box({0.4, 0.4, 0.4}, {2, 2, 2});
    WorldConfig config{.gravity = Eigen::Vector3d::Zero()};
    config.step.max_substeps = 1;
    World world(config);
    WorldBody pressed = box.at({0, 0, 0});
    pressed.state.x *= 0.9;
    world.add_body(std::move(pressed));
    world.add_body(box.at({2, 0, 0}));
    const double before = world.step(1e-3).elastic_energy;
    ASSERT_GT(before, 0);
    world.forces(1).row(0).setConstant(1e9);
    const WorldReport report = world.step(1e-3);
    EXPECT_NE(report.failure.find("body 1: tetrahedron"), std::string::npos) << report.failure;
    EXPECT_EQ(report.elastic_energy, before);
    world.forces(1).setZero();
    EXPECT_NE(world.step(1e-3).elastic_energy, before);
}

/// Two motors that turn a bar in opposite ways cannot both have it; one alone does.
TEST(StepTrouble, JointsThatContradictAreTold) {
    for (const double size : {0.01, 1.0, 100.0})
        for (const bool contradict : {false, true}) {
            SCOPED_TRACE(testing::Message() << size << ' ' << contradict);
            TriMesh box = test::box(size, size / 10, size / 10, 2);
            const test::Model bar(make_rigid_body("bar", std::move(box), 1000), true);
            World world(WorldConfig{});
            world.add_body(bar.at(Eigen::Vector3d::Zero()));
            const double second = std::sqrt(size);
            for (const double angle : {0.5, -0.5})
                if (angle > 0 || contradict)
                    world.add_joint({.name = angle > 0 ? "up" : "down",
                                     .kind = HingeJoint{
                                         .axis = Eigen::Vector3d::UnitY(),
                                         .angle = {.motor = {.times = {0, second}, .values = {0, angle}}}}});
            StepTrouble trouble = StepTrouble::none;
            std::string reason;
            while (world.time() < 0.5 * second && trouble == StepTrouble::none) {
                const WorldReport report = world.step(0.01 * second);
                ASSERT_EQ(report.failure, "");
                trouble = report.trouble;
                reason = report.trouble_reason;
            }
            EXPECT_EQ(trouble, contradict ? StepTrouble::joint : StepTrouble::none) << reason;
            EXPECT_EQ(reason.find("contradicts another joint") != std::string::npos, contradict) << reason;
        }
}

TEST(StepTrouble, NamesAreUnique) {
    EXPECT_STREQ(name(StepTrouble::none), "");
    std::set<std::string> names;
    for (const StepTrouble trouble :
         {StepTrouble::approach, StepTrouble::linear_solver, StepTrouble::newton, StepTrouble::contact_passes,
          StepTrouble::joint, StepTrouble::inverted}) {
        EXPECT_FALSE(std::string(name(trouble)).empty());
        EXPECT_TRUE(names.insert(name(trouble)).second) << name(trouble);
    }
    EXPECT_TRUE(names.contains("contact_passes"));
    EXPECT_TRUE(names.contains("inverted"));
}

/// A box, the nodes of its left side, and a world with it alone.
struct HeldBox {
    Model model{{0.6, 0.2, 0.2}, {6, 2, 2}};
    std::vector<int> left;
    World world;

    explicit HeldBox(const WorldConfig& config = {}) : world(config) {
        const Nodes& X = model.body.tets.X;
        for (int n = 0; n < X.rows(); ++n)
            if (X(n, 0) <= X.col(0).minCoeff() + 1e-9) left.push_back(n);
        world.add_body(model.at({0, 0, 0}));
    }
    Nodes places() const { return world.state(0).x(left, Eigen::all); }
};

TEST(DrivenNodes, ReachTheirTargetsInOneStepAndStayThere) {
    HeldBox box;
    ASSERT_EQ(box.left.size(), 9u);
    const Nodes targets = box.places().rowwise() + Eigen::RowVector3d(0, 0, 0.01);
    box.world.drive(0, box.left, targets);
    for (int step = 0; step < 20; ++step) {
        ASSERT_EQ(box.world.step(0.01).failure, "");
        EXPECT_LT((box.places() - targets).cwiseAbs().maxCoeff(), 1e-12) << step;
    }
    EXPECT_LT(box.world.state(0).x.col(2).minCoeff(), targets.col(2).minCoeff() - 0.005)
        << "the free end hangs";
}

TEST(DrivenNodes, MoveOnStraightLinesThroughTheParts) {
    DrivenNodes driven{
        .nodes = {0}, .from = Nodes::Zero(1, 3), .to = Nodes::Constant(1, 3, 2.0), .start = 1, .end = 3};
    EXPECT_EQ(driven.at(0, 0.5), Eigen::Vector3d(0, 0, 0));
    EXPECT_EQ(driven.at(0, 1.5), Eigen::Vector3d(0.5, 0.5, 0.5));
    EXPECT_EQ(driven.at(0, 3), Eigen::Vector3d(2, 2, 2));
    EXPECT_EQ(driven.at(0, 9), Eigen::Vector3d(2, 2, 2));
}

TEST(DrivenNodes, AreFreedByNone) {
    HeldBox box;
    box.world.drive(0, box.left, box.places());
    box.world.step(0.01);
    const double before = box.places().col(2).mean();
    box.world.drive(0, {}, Nodes(0, 3));
    for (int step = 0; step < 10; ++step) ASSERT_EQ(box.world.step(0.01).failure, "");
    EXPECT_LT(box.places().col(2).mean(), before - 0.03) << "falls";
}

TEST(DrivenNodes, CarryAGivenBodyAlongEveryStep) {
    WorldConfig weightless;
    weightless.gravity.setZero();
    HeldBox box(weightless);
    const double start = box.world.state(0).x.col(1).mean();
    for (int step = 0; step < 100; ++step) {
        box.world.drive(0, box.left, box.places().rowwise() + Eigen::RowVector3d(0, 1e-3, 0));
        ASSERT_EQ(box.world.step(0.01).failure, "");
    }
    EXPECT_NEAR(box.world.state(0).x.col(1).mean() - start, 0.1, 0.03);
}

TEST(DrivenNodes, DoNotGiveWayToContact) {
    WorldConfig config;
    config.contact.thickness = 0.01;
    for (const bool iterates : {false, true}) {
        config.step.newton_iterations = iterates ? 6 : 1;
        HeldBox box(config);
        box.world.add_obstacle(test::floor_at(-0.102));
        const Nodes places = box.places();
        box.world.drive(0, box.left, places);
        int contacts = 0;
        for (int step = 0; step < 5; ++step) {
            const WorldReport report = box.world.step(0.005);
            ASSERT_EQ(report.failure, "");
            contacts += report.contacts;
            EXPECT_LT((box.places() - places).cwiseAbs().maxCoeff(), 1e-12) << step;
        }
        EXPECT_GT(contacts, 0);
    }
}

TEST(DrivenNodes, MoveToTheirTargetsFromARestoredState) {
    HeldBox box;
    const WorldSnapshot start = box.world.snapshot();
    const Nodes targets = box.places().rowwise() + Eigen::RowVector3d(0, 0, 0.01);
    for (int step = 0; step < 4; ++step) {
        box.world.drive(0, box.left, box.places().rowwise() + Eigen::RowVector3d(0, 0, 0.0025));
        box.world.step(0.01);
    }
    box.world.restore(start);
    box.world.step(0.01);
    EXPECT_LT((box.places() - targets).cwiseAbs().maxCoeff(), 1e-12);
}

TEST(DrivenNodes, GiveWayToGripsThatHoldThemAgain) {
    const Model model({0.6, 0.2, 0.2}, {6, 2, 2});
    WorldBody body = model.at({0, 0, 0});
    body.grips.push_back({.nodes = {0, 1, 2}, .release = 0.015});
    World world(WorldConfig{});
    world.add_body(body);
    const WorldSnapshot start = world.snapshot();
    const Nodes held = world.state(0).x.topRows<3>();
    world.step(0.01);
    world.step(0.01);
    world.drive(0, {0, 1, 2}, held.array() + 0.01);
    world.step(0.01);
    world.restore(start);
    ASSERT_EQ(world.step(0.01).failure, "");
    EXPECT_LT((world.state(0).x.topRows<3>() - held).cwiseAbs().maxCoeff(), 1e-12);
}

TEST(DrivenNodes, AreRefusedWithWhatIsWrong) {
    HeldBox box;
    EXPECT_EQ(test::error_of([&] {
                  box.world.drive(0, {3, 3}, Nodes::Zero(2, 3));
              }),
              "world: driven node 3 is named twice, or held by a grip");
    EXPECT_EQ(test::error_of([&] { box.world.drive(0, {-1}, Nodes::Zero(1, 3)); }),
              "world: driven node -1 is not in 0..62");
    EXPECT_EQ(test::error_of([&] {
                  box.world.drive(0, {1, 2}, Nodes::Zero(1, 3));
              }),
              "world: 2 driven nodes need as many targets, not 1");
    Nodes bad = Nodes::Zero(1, 3);
    bad(0, 1) = std::numeric_limits<double>::quiet_NaN();
    EXPECT_EQ(test::error_of([&] { box.world.drive(0, {1}, bad); }),
              "world: a target of driven nodes is not finite");
}

TEST(World, KeepsItsStateInOnePlaceInMemory) {
    for (const TimeIntegrator integrator : {TimeIntegrator::backward_euler, TimeIntegrator::second_order}) {
        WorldConfig config;
        config.step.integrator = integrator;
        HeldBox box(config);
        const double *x = box.world.state(0).x.data(), *v = box.world.state(0).v.data();
        const WorldSnapshot start = box.world.snapshot();
        for (int step = 0; step < 5; ++step) ASSERT_EQ(box.world.step(0.01).failure, "");
        box.world.restore(start);
        box.world.step(0.01);
        EXPECT_EQ(box.world.state(0).x.data(), x);
        EXPECT_EQ(box.world.state(0).v.data(), v);
    }
}

}  // namespace
}  // namespace nbd
