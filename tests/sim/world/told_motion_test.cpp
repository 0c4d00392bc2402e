// Grips and obstacles that move by keyframes.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <vector>

#include "sim/fem/momentum.hpp"
#include "sim/obstacles/made_mesh.hpp"
#include "tests/sim/world/box_model.hpp"
#include "tests/support/box_mesh.hpp"
#include "tests/support/error_of.hpp"

namespace nbd {
namespace {

using Eigen::Vector3d;
using test::Model;

constexpr double g = 9.81, pi = std::numbers::pi;

/// Turns about the z axis at a constant rate, rad/s.
Motion spin(double rate) {
    return {.keyframes = {{.to_next = Interpolation::linear}, {.time = 100, .rotation = {0, 0, 100 * rate}}}};
}

Vector3d centre_of(const World& world, int body) {
    return centre_of_mass(world.elastic(body), world.state(body).x);
}

/// A flat block on a table that turns about the z axis, at rest on it at the start, `arm` from the axis.
World turntable(const Obstacle& table, double size, double arm, double rate) {
    const Model block(size * Vector3d(1, 1, 0.4), {2, 2, 1}, {.young = 1e6, .rayleigh_mass = 0});
    World world(WorldConfig{});
    world.add_obstacle(table);
    WorldBody body = block.at({arm, 0, 0.2005 * size});
    for (Eigen::Index i = 0; i < body.state.x.rows(); ++i)
        body.state.v.row(i) = rate * Vector3d::UnitZ().cross(body.state.x.row(i).transpose()).transpose();
    world.add_body(std::move(body));
    return world;
}

/// How far a point slides on the table until `time`: its distance from the axis, by small steps of the
/// equation of Coulomb's friction.
double slid_to(double arm, double rate, double mu, double time) {
    constexpr int steps = 200000;
    Eigen::Vector2d x(arm, 0), v(0, rate * arm);
    const double dt = time / steps;
    for (int i = 0; i < steps; ++i) {
        const Eigen::Vector2d slip = v - rate * Eigen::Vector2d(-x.y(), x.x());
        if (slip.norm() > 1e-9) v -= dt * mu * g * slip.normalized();
        if (slip.norm() <= 1e-9) {  // the friction that it needs to go around is more than it has
            const Eigen::Vector2d inward = -x.normalized();
            v += dt * mu * g * inward;
        }
        x += dt * v;
    }
    return x.norm();
}

Obstacle disc(double radius, double thickness, double friction, const Motion& motion) {
    TriMesh mesh = cylinder_mesh(radius, thickness, 48);
    mesh.X.col(2).array() -= thickness / 2;
    return {.shape = std::make_shared<const StaticSurface>(std::move(mesh)),
            .motion = motion,
            .friction = friction};
}

TEST(Turntable, CarriesABodyAroundBelowTheLimitOfFriction) {
    constexpr double mu = 0.4;
    for (const bool is_mesh : {false, true})
        for (const double size : {0.05, 1.0})
            for (const double step : {0.5, 2.0}) {
                const double arm = 4 * size, rate = std::sqrt(0.7 * mu * g / arm),
                             dt = step * 5e-3 * std::sqrt(size / 0.05);
                const Motion motion = spin(rate);
                World world =
                    turntable(is_mesh ? disc(8 * size, size, mu, motion)
                                      : Obstacle{.shape = PlaneShape{}, .motion = motion, .friction = mu},
                              size, arm, rate);
                const Nodes start = world.state(0).x;
                while (world.time() < 1.5 * pi / rate) ASSERT_EQ(world.step(dt).failure, "");
                const Eigen::Matrix3d turn =
                    Eigen::AngleAxisd(rate * world.time(), Vector3d::UnitZ()).toRotationMatrix();
                const Nodes expected = start * turn.transpose();
                const double off = (world.state(0).x - expected).leftCols<2>().cwiseAbs().maxCoeff();
                EXPECT_LT(off, 2e-3 * arm) << is_mesh << ' ' << size << ' ' << step;
            }
}

TEST(Turntable, LosesABodyAboveTheLimitOfFriction) {
    constexpr double mu = 0.4;
    for (const bool is_mesh : {false, true})
        for (const double size : {0.05, 1.0}) {
            const double arm = 20 * size, rate = std::sqrt(1.3 * mu * g / arm), time = 2.5 / rate;
            World world =
                turntable(is_mesh ? disc(60 * size, size, mu, spin(rate))
                                  : Obstacle{.shape = PlaneShape{}, .motion = spin(rate), .friction = mu},
                          size, arm, rate);
            for (int i = 0; i < 250; ++i) ASSERT_EQ(world.step(time / 250).failure, "");
            const double gone = centre_of(world, 0).head<2>().norm() - arm,
                         expected = slid_to(arm, rate, mu, time) - arm;
            EXPECT_GT(expected, 0.2 * arm);
            EXPECT_NEAR(gone, expected, 0.03 * expected) << is_mesh << ' ' << size;
        }
}

/// A plane or a board that tips by an angle in a second and holds; a block on it.
World tipping(bool is_mesh, double angle, double mu) {
    const Motion motion{.centre = {0, 0, -0.5}, .keyframes = {{}, {.time = 1, .rotation = {0, angle, 0}}}};
    const Model block({0.2, 0.2, 0.05}, {2, 2, 1}, {.young = 1e6});
    World world(WorldConfig{});
    Obstacle board{.shape = PlaneShape{}, .motion = motion, .friction = mu};
    if (is_mesh) {
        TriMesh mesh = box_mesh({4, 2, 0.1});
        mesh.X.col(2).array() -= 0.05;
        board.shape = std::make_shared<const StaticSurface>(std::move(mesh));
    }
    world.add_obstacle(board);
    world.add_body(block.at({0, 0, 0.0253}));
    return world;
}

TEST(TippingBoard, HoldsABlockBelowTheAngleOfFrictionAndLosesItAbove) {
    constexpr double mu = 0.5;  // 26.6 degrees
    for (const bool is_mesh : {false, true})
        for (const double dt : {2e-3, 1e-2})
            for (const double degrees : {22.0, 32.0}) {
                const double angle = degrees * pi / 180;
                World world = tipping(is_mesh, angle, mu);
                while (world.time() < 2) ASSERT_EQ(world.step(dt).failure, "");
                const Placing placing = world.obstacles()[0].motion.at(world.time());
                const Vector3d slid = placing.inverse(centre_of(world, 0)) - Vector3d(0, 0, 0.025);
                if (degrees < 26)
                    EXPECT_LT(slid.norm(), 2e-3) << is_mesh << ' ' << dt;
                else
                    EXPECT_GT(slid.x(), 0.1) << is_mesh << ' ' << dt;
                EXPECT_NEAR(slid.z(), 0, 1e-3) << "it lies on the board";
            }
}

TEST(ScaledObstacle, PushesABodyAsItGrows) {
    for (const bool is_mesh : {false, true}) {
        const Model box({0.2, 0.2, 0.2}, {3, 3, 3}, {.young = 1e6});
        World world(WorldConfig{.gravity = Vector3d::Zero()});
        const Motion motion{.keyframes = {{}, {.time = 0.5, .scale = 3}}};
        Obstacle growing{.shape = BallShape{.centre = {0, 0, 0}, .radius = 0.1}, .motion = motion};
        if (is_mesh) growing.shape = std::make_shared<const StaticSurface>(box_mesh({0.2, 0.2, 0.2}));
        world.add_obstacle(growing);
        world.add_body(box.at({0.21, 0.01, -0.02}));
        while (world.time() < 0.6) {
            ASSERT_EQ(world.step(5e-3).failure, "");
            ASSERT_TRUE(world.intersecting_faces().empty());
        }
        EXPECT_GT(world.surface(0).col(0).minCoeff(), 0.3 - 1e-3);
    }
}

/// A bar that a grip holds at one end, lets go, and that another grip takes, lifts and turns.
World taken_twice(double release, double take) {
    const Model bar({0.5, 0.1, 0.1}, {5, 2, 2}, {.young = 1e5, .rayleigh_mass = 1});
    World world(WorldConfig{});
    WorldBody body = bar.at({0, 0, 0});
    const auto end = test::nodes_where(body.state.x, [](const Vector3d& x) { return x.x() < -0.24; });
    body.grips = {{.nodes = end, .release = release},
                  {.nodes = end,
                   .motion = {.centre = {-0.25, 0, 0},
                              .keyframes = {{.time = take},
                                            {.time = take + 0.1,
                                             .translation = {0, 0, 0.2},
                                             .rotation = {4 * pi, 0, 0},
                                             .to_next = Interpolation::hold}}},
                   .take = take}};
    world.add_body(std::move(body));
    return world;
}

TEST(LaterGrip, TakesTheNodesOfAnEarlierOneWhereTheyAreThen) {
    for (const double dt : {2.5e-3, 1e-2}) {
        World world = taken_twice(0.1, 0.2);
        const std::vector<int> nodes =
            test::nodes_where(world.state(0).x, [](const Vector3d& x) { return x.x() < -0.24; });
        const auto places = [&] { return Nodes(world.state(0).x(nodes, Eigen::all)); };
        const Nodes start = places();
        const auto run_until = [&](double time) {
            while (world.time() < time - 1e-9) ASSERT_EQ(world.step(dt).failure, "");
        };
        run_until(0.1);
        EXPECT_EQ(places(), start);
        run_until(0.2);
        const Nodes fallen = places();
        EXPECT_NEAR((fallen - start).col(2).mean(), -g * 0.1 * 0.1 / 2, 0.02);
        run_until(0.26);
        const Placing halfway =
            Motion{.centre = {-0.25, 0, 0},
                   .keyframes = {{.time = 0.2},
                                 {.time = 0.3, .translation = {0, 0, 0.2}, .rotation = {4 * pi, 0, 0}}}}
                .at(world.time());
        for (std::size_t k = 0; k < nodes.size(); ++k) {
            const Eigen::Index row = k;
            EXPECT_LT((halfway(fallen.row(row)) - places().row(row).transpose()).norm(), 1e-12);
        }
        run_until(0.5);
        const Nodes lifted = fallen.rowwise() + Eigen::RowVector3d(0, 0, 0.2);
        EXPECT_LT((places() - lifted).cwiseAbs().maxCoeff(), 1e-12) << "two whole turns";
        for (const int node : nodes) EXPECT_EQ(world.state(0).v.row(node).norm(), 0) << "it stands";
    }
}

TEST(LaterGrip, IsKeptBySnapshots) {
    World first = taken_twice(0.1, 0.2);
    std::vector<WorldSnapshot> snapshots{first.snapshot()};
    for (int i = 0; i < 40; ++i) {
        ASSERT_EQ(first.step(1e-2).failure, "");
        snapshots.push_back(first.snapshot());
    }
    EXPECT_TRUE(snapshots[20].taken_at.empty());
    EXPECT_EQ(snapshots[21].taken_at.at(0).at(0).rows(), 0) << "taken when the body was added";
    EXPECT_GT(snapshots[21].taken_at.at(0).at(1).rows(), 0);
    for (const std::size_t from : {0u, 15u, 20u, 21u, 25u, 35u}) {
        World other = taken_twice(0.1, 0.2);
        for (int i = 0; i < 23; ++i) other.step(1e-2);  // has taken them elsewhere, if later
        other.restore(snapshots[from]);
        for (std::size_t i = from; i < 40; ++i) other.step(1e-2);
        EXPECT_EQ(other.state(0).x, first.state(0).x) << from;
        EXPECT_EQ(other.state(0).v, first.state(0).v) << from;
    }
    WorldSnapshot wrong = snapshots[21];
    wrong.taken_at[0].pop_back();
    EXPECT_EQ(test::refusal([&] { first.restore(wrong); }), "world: the snapshot of body 0 does not fit it");
}

TEST(LaterGrip, HoldsNothingAtTheStart) {
    const Model box({0.4, 0.4, 0.4}, {2, 2, 2});
    for (const double take : {0.0, 0.5}) {
        World world(WorldConfig{});
        world.add_obstacle(test::floor_at(-0.2));  // touches it, as only what is held may
        WorldBody body = box.at({0, 0, 0});
        body.grips = {
            {.nodes = test::nodes_where(body.state.x, [](const Vector3d& x) { return x.z() < -0.19; }),
             .take = take}};
        world.add_body(std::move(body));
        EXPECT_EQ(test::refusal([&] { world.check_start(); }).empty(), take == 0);
    }
}

TEST(LaterGrip, MustNotTakeWhatAnotherHolds) {
    EXPECT_EQ(test::refusal([] { taken_twice(0.3, 0.2); }).substr(0, 55),
              "world: grips 0 and 1 of a body both hold node 0 at 0.2 ");
    EXPECT_EQ(test::refusal([] { taken_twice(0.2, 0.2); }), "");
    EXPECT_NE(test::refusal([] { taken_twice(-1, 0.2); }).find("must not release them before it takes them"),
              std::string::npos);
}

TEST(MovedObstacle, GoesWhereItIsToldInEachStep) {
    const Model box({0.2, 0.2, 0.2}, {2, 2, 2}, {.young = 1e6});
    const auto build = [&] {
        World world(WorldConfig{});
        world.add_obstacle(test::floor_at(0));
        world.add_body(box.at({0, 0, 0.101}));
        return world;
    };
    constexpr double dt = 5e-3;
    const auto place = [](double time) {
        return Keyframe{.translation = {0, 0, 0.3 * time * time}, .rotation = {0, 0, 4 * time * time}};
    };
    World world = build();
    std::vector<WorldSnapshot> snapshots{world.snapshot()};
    for (int i = 0; i < 100; ++i) {
        world.move_obstacle(0, place((i + 1) * dt));
        ASSERT_EQ(world.step(dt).failure, "");
        snapshots.push_back(world.snapshot());
    }
    EXPECT_NEAR(world.obstacles()[0].motion.at(world.time()).translation.z(), 0.3 * 0.25, 1e-12);
    EXPECT_NEAR(centre_of(world, 0).z(), 0.1 + 0.3 * 0.25, 2e-3);
    const Vector3d corner = world.state(0).x.row(0).transpose() - centre_of(world, 0);
    const Vector3d at_start = box.body.tets.X.row(0);
    EXPECT_NEAR(std::atan2(corner.y(), corner.x()),
                std::remainder(std::atan2(at_start.y(), at_start.x()) + 1, 2 * pi), 0.02)
        << "friction turns it";
    const Nodes end = world.state(0).x;
    world.restore(snapshots[40]);
    for (int i = 40; i < 100; ++i) {
        world.move_obstacle(0, place((i + 1) * dt));
        world.step(dt);
    }
    EXPECT_EQ(world.state(0).x, end);
    world.step(dt);
    EXPECT_EQ(world.obstacles()[0].motion.at(world.time()).translation.z(), 0.3 * 0.25) << "it stays";
    EXPECT_EQ(test::refusal([&] { world.move_obstacle(1, {}); }), "world: obstacle 1 is not one of its 1");
    EXPECT_NE(test::refusal([&] { world.move_obstacle(0, {.scale = -1}); }), "");
}

/// A sheet over the square of 2 m about the origin, with waves.
Obstacle waves(double height) {
    Eigen::MatrixXd heights(21, 21);
    for (int i = 0; i <= 20; ++i)
        for (int j = 0; j <= 20; ++j) heights(i, j) = height * std::sin(0.7 * i) * std::cos(0.6 * j);
    TriMesh mesh = height_mesh(heights, {0.1, 0.1});
    mesh.X.rowwise() -= Eigen::RowVector3d(1, 1, 0);
    return {.shape = std::make_shared<const StaticSurface>(std::move(mesh))};
}

TEST(Sheet, CarriesABodyOnEitherSideAndLetsNothingPass) {
    for (const double side : {-1.0, 1.0})
        for (const double speed : {0.0, 8.0}) {
            const Model box({0.3, 0.3, 0.2}, {3, 3, 2}, {.young = 1e5});
            World world(WorldConfig{.gravity = {0, 0, -side * g}});
            world.add_obstacle(waves(0.03));
            world.add_body(
                box.at({0.03, -0.02, side * 0.4}, Eigen::Matrix3d::Identity(), {0, 0, -side * speed}));
            for (int i = 0; i < 240; ++i) {
                ASSERT_EQ(world.step(5e-3).failure, "");
                ASSERT_TRUE(world.intersecting_faces().empty());
                ASSERT_GT((side * world.surface(0).col(2)).minCoeff(), -0.04) << "it is on its side";
            }
            EXPECT_LT((side * world.surface(0).col(2)).minCoeff(), 0.06) << "it lies on the sheet";
        }
}

}  // namespace
}  // namespace nbd
