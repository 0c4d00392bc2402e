
#include <gtest/gtest.h>

#include "sim/world/world.hpp"
#include "tests/sim/world/box_model.hpp"
#include "tests/support/error_of.hpp"

namespace nbd {
namespace {

using test::Model;

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
    for (const TimeIntegrator integrator : {TimeIntegrator::backward_euler, TimeIntegrator::bdf2}) {
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
