// Worlds of quadratic tetrahedra: free motion, rest against beam theory, contact.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <tuple>
#include <utility>
#include <vector>

#include "meshing/body/make_body.hpp"
#include "meshing/surface/quadratic_tets.hpp"
#include "sim/fem/momentum.hpp"
#include "tests/sim/support/momentum.hpp"
#include "tests/sim/support/one_body_world.hpp"
#include "tests/sim/world/box_model.hpp"
#include "tests/support/box_body.hpp"
#include "tests/support/box_mesh.hpp"
#include "tests/support/on_threads.hpp"

namespace nbd {
namespace {

using test::floor_at;
using test::Model;
using test::turned;

TetMesh quadratic_box(const Eigen::Vector3d& size, const Eigen::Vector3i& cells) {
    return make_quadratic(test::box_mesh(size, cells));
}

/// levels: of the collision surface.
Model quadratic_model(const Eigen::Vector3d& size, const Eigen::Vector3i& cells, const Material& material,
                      int levels = 0) {
    TetMesh mesh = quadratic_box(size, cells);
    mesh.X.rowwise() -= 0.5 * size.transpose();
    return Model(make_body("box", std::move(mesh), material, levels), true);
}

Material rubber(MaterialLaw law, double young, double ratio) {
    return {.young = young,
            .poisson = ratio,
            .density = 1000,
            .rayleigh_mass = 0,
            .rayleigh_stiffness = 0,
            .law = law};
}

WorldConfig world_with(const Eigen::Vector3d& gravity = Eigen::Vector3d::Zero()) {
    return {.gravity = gravity};
}

/// One element thick, also at ratios at which linear tetrahedra lock: Timoshenko's sag. The end is held in
/// all directions, which that of a beam is not, and which counts the more the larger the ratio is: for 3 % at
/// 0.499 with ever finer elements.
TEST(QuadraticElements, BendAsBeamsDoWhereOneIsAsThickAsTheBeam) {
    const double L = 1, a = 0.1, young = 1e7, g = 1e-3;
    for (const auto& [ratio, allowed] : {std::pair(0.0, 0.01), {0.3, 0.03}, {0.45, 0.06}, {0.499, 0.12}}) {
        const ElasticBody body(quadratic_box({L, a, a}, {20, 1, 1}),
                               {.young = young, .poisson = ratio, .density = 1000});
        const std::vector<int> held =
            test::nodes_where(body.rest().X, [](const Eigen::Vector3d& p) { return p[0] < 1e-9; });
        const Nodes u = test::static_displacements(body, held, {.gravity = {0, 0, -g}, .forces = {}});
        const std::vector<int> tip =
            test::nodes_where(body.rest().X, [&](const Eigen::Vector3d& p) { return p[0] > L - 1e-9; });
        const double load = 1000 * a * a * g, inertia = std::pow(a, 4) / 12,
                     shear = 10 * (1 + ratio) / (12 + 11 * ratio) * young / (2 * (1 + ratio)) * a * a,
                     sag = load * std::pow(L, 4) / (8 * young * inertia) + load * L * L / (2 * shear);
        EXPECT_NEAR(-u(tip, 2).mean(), sag, allowed * sag) << ratio;
    }
}

/// The most kinetic and elastic energy that a body has in steps of dt, seen from what moves at u, over what
/// it has first: `first`, or after one step.
double most_energy(World& world, int steps, double dt, std::optional<double> first = {},
                   const Eigen::Vector3d& u = Eigen::Vector3d::Zero()) {
    double most = 0;
    for (int s = 0; s < steps; ++s) {
        const WorldReport report = world.step(dt);
        EXPECT_EQ(report.failure, "") << s;
        if (!report.failure.empty()) break;
        const double mass = world.elastic(0).mass(), energy = report.kinetic_energy + report.elastic_energy -
                                                              test::linear_momentum(world).dot(u) +
                                                              mass / 2 * u.squaredNorm();
        if (!first) first = energy;
        most = std::max(most, energy);
    }
    return most / *first;
}

// Far from what one linearisation tells: no energy comes out of nothing, by any law.

TEST(QuadraticElements, LetGoFarFromRestMakeNoEnergy) {
    for (const auto& [law, ratio, dt] : {std::tuple(MaterialLaw::corotated, 0.45, 2e-3),
                                         {MaterialLaw::stable_neo_hookean, 0.45, 2e-3},
                                         {MaterialLaw::stable_neo_hookean, 0.45, 5e-3}}) {
        const Model bar = quadratic_model({0.4, 0.1, 0.1}, {4, 1, 1}, rubber(law, 1e6, ratio), 1);
        World world(world_with());
        WorldBody body = bar.at({0, 0, 0});
        body.state.x.col(0) *= 1.6;
        const double first = body.elastic->measure(body.state.x).energy;
        world.add_body(std::move(body));
        EXPECT_LT(most_energy(world, 50, dt, first), 1.02) << ratio << ' ' << dt;
    }
}

/// Also seen from what goes along fast.
TEST(QuadraticElements, ThatSpinFastMakeNoEnergy) {
    for (const auto& [law, young, ratio, rate, dt, speed] :
         {std::tuple(MaterialLaw::stable_neo_hookean, 1e5, 0.499, 59.0, 2e-3, 0.0),
          {MaterialLaw::stable_neo_hookean, 1e5, 0.499, 6.0, 2e-2, 0.0},
          {MaterialLaw::corotated, 1e5, 0.4999, 20.0, 1e-2, 0.0},
          {MaterialLaw::corotated, 1e5, 0.4999, 20.0, 1e-2, 100.0},
          {MaterialLaw::corotated, 1e6, 0.4999, 40.0, 5e-3, 0.0}}) {
        const Model block = quadratic_model({0.1, 0.1, 0.15}, {2, 2, 3}, rubber(law, young, ratio), 1);
        World world(world_with());
        WorldBody body = block.at({0, 0, 0});
        const Eigen::Vector3d spin = rate * Eigen::Vector3d(1, 3, 5).normalized(), u(speed, 0, 0);
        for (Eigen::Index i = 0; i < body.state.x.rows(); ++i)
            body.state.v.row(i) = (u + spin.cross(body.state.x.row(i).transpose())).transpose();
        world.add_body(std::move(body));
        EXPECT_LT(most_energy(world, 40, dt, {}, u), 1.05) << rate << ' ' << dt << ' ' << speed;
    }
}

/// Blocks on a floor, also in air that weighs nothing.
TEST(QuadraticElements, ThatHitAFloorMakeNoEnergy) {
    for (const auto& [levels, law, young, ratio, dt, speed] :
         {std::tuple(1, MaterialLaw::stable_neo_hookean, 1e6, 0.49, 1e-2, 1.0),
          {1, MaterialLaw::corotated, 1e6, 0.4999, 1e-2, 3.0},
          {1, MaterialLaw::corotated, 1e6, 0.499, 5e-3, 5.0},
          {1, MaterialLaw::corotated, 1e5, 0.4999, 2e-2, 1.0},
          {0, MaterialLaw::corotated, 1e5, 0.499, 1e-2, 3.0},
          {0, MaterialLaw::corotated, 1e5, 0.4999, 1e-2, 3.0}}) {
        const Material material = rubber(law, young, ratio);
        const Model cube = levels > 0 ? quadratic_model({0.1, 0.1, 0.1}, {2, 2, 2}, material, levels)
                                      : Model({0.1, 0.1, 0.1}, {2, 2, 2}, material);
        World world(world_with());
        WorldBody body = cube.at({0, 0, 0.06}, Eigen::Matrix3d::Identity(), {0, 0, -speed});
        body.loads = {{.kind = LoadKind::wind, .air = {.density = 1e-9}}};
        const double first = body.elastic->mass() * speed * speed / 2;
        world.add_body(std::move(body));
        world.add_obstacle(test::floor_at(0, 0));
        EXPECT_LT(most_energy(world, 30, dt, first), 1.02) << levels << ' ' << ratio << ' ' << dt;
    }
}

TEST(QuadraticElements, FallFreelyAndKeepTheirAngularMomentum) {
    for (const double size : {0.01, 1.0, 100.0}) {
        const ElasticBody body(quadratic_box({size, 0.6 * size, 0.3 * size}, {2, 1, 1}),
                               {.young = 1e6, .rayleigh_mass = 0, .rayleigh_stiffness = 1e-3});
        BodyState start{body.rest().X, Nodes::Zero(body.node_count(), 3)};
        const Eigen::Vector3d centre = centre_of_mass(body, start.x), spin(3, 1, -2);
        for (Eigen::Index i = 0; i < start.x.rows(); ++i)
            start.v.row(i) = spin.cross(start.x.row(i).transpose() - centre).transpose();
        const Momentum before = momentum_of(body, start);
        test::OneBodyWorld world(body, world_with({0, 0, -9.81}), start);
        const int steps = 200;
        const double dt = 2e-3, time = steps * dt;
        world.steps(steps, dt);
        const Momentum after = momentum_of(body, world.state());
        EXPECT_LT((after.angular - before.angular).norm(), 1e-4 * before.angular.norm()) << size;
        EXPECT_NEAR(after.linear[2], -9.81 * time * body.mass(), 1e-6 * body.mass()) << size;
        EXPECT_NEAR(centre_of_mass(body, world.state().x)[2] - centre[2], -0.5 * 9.81 * time * time,
                    0.01 * 0.5 * 9.81 * time * time)
            << size;
    }
}

/// Without damping, a bar held at no node keeps its energy as linear ones do.
TEST(QuadraticElements, RingAsLongAsTheRuleLetsThem) {
    const double young = 1e5;
    const ElasticBody body(quadratic_box({1, 0.3, 0.3}, {4, 1, 1}),
                           {.young = young, .poisson = 0, .rayleigh_mass = 0, .rayleigh_stiffness = 0});
    BodyState start{body.rest().X, Nodes::Zero(body.node_count(), 3)};
    for (Eigen::Index i = 0; i < start.x.rows(); ++i)
        start.x(i, 0) -= 0.05 / std::numbers::pi * std::cos(std::numbers::pi * body.rest().X(i, 0));
    const auto energy = [&](const BodyState& state) {
        return body.measure(state.x).energy + kinetic_energy(body, state.v);
    };
    WorldConfig config = test::exact_steps(60, 1e-11);
    config.step.integrator = TimeIntegrator::second_order;
    const double period = 2 / std::sqrt(young / 1000);
    test::OneBodyWorld world(body, config, start);
    world.steps(100, period / 50);
    EXPECT_GT(energy(world.state()), 0.97 * energy(start));
    EXPECT_LE(energy(world.state()), energy(start));
}

/// levels: of the surfaces; 3 makes them much finer than their tetrahedra.
struct Collision {
    Eigen::Vector3d change = Eigen::Vector3d::Zero(), exchanged = change;
    int contacts = 0;
    Nodes end{};
};

Collision collide(int levels, double size, const Eigen::Vector3d& far) {
    const Model model = quadratic_model(size * Eigen::Vector3d(0.4, 0.3, 0.3), {2, 1, 1},
                                        {.young = 1e5, .rayleigh_mass = 0}, levels);
    World world(world_with());
    world.add_body(model.at(far, turned(0.2), size * Eigen::Vector3d(2, 0, 0)));
    world.add_body(model.at(far + size * Eigen::Vector3d(0.55, 0.06, 0.03), turned(-0.5),
                            size * Eigen::Vector3d(-1, 0, 0.2)));
    const auto momentum = [&](int b) -> Eigen::Vector3d {
        return momentum_of(*model.elastic, world.state(b)).linear;
    };
    const Eigen::Vector3d first = momentum(0), both = first + momentum(1);
    Collision result;
    for (int i = 0; i < 40; ++i) {
        const WorldReport report = world.step(5e-3);
        EXPECT_EQ(report.failure, "");
        EXPECT_TRUE(world.intersecting_faces().empty()) << i;
        result.contacts += report.contacts;
    }
    result.change = momentum(0) + momentum(1) - both;
    result.exchanged = momentum(0) - first;
    result.end = world.state(0).x;
    return result;
}

TEST(QuadraticElements, CollideWithoutIntersectionsAndKeepMomentum) {
    for (const int levels : {0, 3})
        for (const double size : {0.02, 1.0}) {
            const Collision found = collide(levels, size, {0, 0, 0});
            EXPECT_GT(found.contacts, 0) << levels;
            EXPECT_GT(found.exchanged.norm(), 0);
            EXPECT_LT(found.change.norm(), 1e-9 * found.exchanged.norm()) << levels << ' ' << size;
        }
}

TEST(QuadraticElements, CollideTheSameOnOneAndMoreThreads) {
    const auto end = [](int threads) {
        return test::on_threads(threads, [] { return collide(3, 1, {0, 0, 0}).end; });
    };
    EXPECT_EQ(end(1), end(3));
}

TEST(QuadraticElements, RestOnAFloor) {
    const Model model = quadratic_model({0.2, 0.2, 0.2}, {1, 1, 1}, {.young = 1e5, .rayleigh_mass = 20}, 2);
    World world(world_with({0, 0, -9.81}));
    world.add_obstacle(floor_at(0));
    world.add_body(model.at({0, 0, 0.101}));
    for (int i = 0; i < 400; ++i) EXPECT_EQ(world.step(5e-3).failure, "");
    const Nodes surface = embedded(model.body.W, world.state(0).x);
    EXPECT_GT(surface.col(2).minCoeff(), 0);
    EXPECT_LT(surface.col(2).minCoeff(), 1e-3);
    EXPECT_LT(world.state(0).v.rowwise().norm().maxCoeff(), 1e-3);
}

}  // namespace
}  // namespace nbd
