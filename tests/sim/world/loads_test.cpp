#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <memory>
#include <vector>

#include "meshing/body/make_body.hpp"
#include "meshing/surface/quadratic_tets.hpp"
#include "sim/world/body_load.hpp"
#include "sim/world/world.hpp"
#include "tests/sim/support/momentum.hpp"
#include "tests/sim/world/box_model.hpp"
#include "tests/support/box_body.hpp"
#include "tests/support/box_mesh.hpp"
#include "tests/support/error_of.hpp"

namespace nbd {
namespace {

using test::Model;

Model loaded_box(const Eigen::Vector3d& size, const Eigen::Vector3i& cells, bool is_quadratic,
                 const Material& material) {
    if (!is_quadratic) return Model(size, cells, material);
    TetMesh mesh = make_quadratic(test::box_mesh(size, cells));
    mesh.X.rowwise() -= 0.5 * size.transpose();
    return Model(make_body("box", std::move(mesh), material, 1), true);
}

WorldConfig weightless(TimeIntegrator integrator = TimeIntegrator::second_order, int newton_iterations = 1) {
    return {.gravity = Eigen::Vector3d::Zero(),
            .step = {.integrator = integrator, .newton_iterations = newton_iterations}};
}

/// Long steps that end in balance.
WorldConfig to_balance(int newton_iterations = 1) {
    WorldConfig config = weightless(TimeIntegrator::backward_euler, newton_iterations);
    config.step.newton_tolerance = 1e-9;
    config.linear.tolerance = 1e-10;
    return config;
}

void run_steps(World& world, int steps, double dt) {
    for (int i = 0; i < steps; ++i) ASSERT_EQ(world.step(dt).failure, "") << i;
}

std::vector<int> nodes_of(const WorldBody& body, const std::function<bool(const Eigen::Vector3d&)>& is_in) {
    std::vector<int> nodes;
    for (int i = 0; i < body.state.x.rows(); ++i)
        if (is_in(body.state.x.row(i).transpose())) nodes.push_back(i);
    EXPECT_FALSE(nodes.empty());
    return nodes;
}

const Material free_of_drag{.young = 1e5, .rayleigh_mass = 0};

TEST(BodyLoads, AConstantForceMovesAFreeBodyByHalfItsAccelerationTimesTimeSquared) {
    for (const bool is_quadratic : {false, true})
        for (const double dt : {2e-3, 1e-2}) {
            const Model box = loaded_box({0.4, 0.2, 0.3}, {3, 2, 2}, is_quadratic, free_of_drag);
            World world(weightless());
            WorldBody body = box.at({0, 0, 0}, test::turned(0.3));
            const Eigen::Vector3d F(3, -2, 1);
            body.loads = {{.kind = LoadKind::force, .value = F}};
            world.add_body(std::move(body));
            const int steps = static_cast<int>(std::lround(0.2 / dt));
            run_steps(world, steps, dt);
            const Eigen::Vector3d expected = 0.5 * 0.04 / world.elastic(0).mass() * F;
            EXPECT_LT((test::centre_of_mass(world, 0) - expected).norm(), 0.5 * dt / 0.2 * expected.norm());
            EXPECT_LT((test::linear_momentum(world, 0) - 0.2 * F).norm(), 1e-9);
            EXPECT_LT(test::angular_momentum(world, 0, test::centre_of_mass(world, 0)).norm(), 1e-9);
        }
}

TEST(BodyLoads, ATorqueAddsAngularMomentumAndNothingElse) {
    for (const bool is_quadratic : {false, true})
        for (const bool is_part : {false, true}) {
            const Model box = loaded_box({0.4, 0.2, 0.3}, {4, 2, 3}, is_quadratic, free_of_drag);
            World world(weightless());
            WorldBody body = box.at({0.5, 0.2, 0});
            const Eigen::Vector3d T(0.1, 0.3, -0.2);
            body.loads = {{.kind = LoadKind::torque, .value = T}};
            if (is_part)
                body.loads[0].nodes = nodes_of(body, [](const Eigen::Vector3d& x) { return x[0] > 0.6; });
            world.add_body(std::move(body));
            run_steps(world, 60, 5e-3);
            const Eigen::Vector3d about = test::centre_of_mass(world, 0);
            EXPECT_LT((about - Eigen::Vector3d(0.5, 0.2, 0)).norm(), 1e-9);
            const Momentum momentum = momentum_of(world.elastic(0), world.state(0));
            EXPECT_LT((momentum.angular - 0.3 * T).norm(), 1e-6 * T.norm()) << is_quadratic << is_part;
        }
}

TEST(BodyLoads, AnImpulseIsTheIntegralOfTheFactor) {
    for (const TimeIntegrator rule : {TimeIntegrator::second_order, TimeIntegrator::backward_euler})
        for (const double dt : {2e-3, 1e-2}) {
            const Model box = loaded_box({0.4, 0.2, 0.3}, {2, 2, 2}, false, free_of_drag);
            World world(weightless(rule));
            WorldBody body = box.at({0, 0, 0});
            const Eigen::Vector3d F(3, -2, 1);
            body.loads = {{.kind = LoadKind::force,
                           .value = F,
                           .factor = {.times = {0.02, 0.1, 0.16, 0.2}, .values = {0, 1, 1, 0}}}};
            world.add_body(std::move(body));
            run_steps(world, static_cast<int>(std::lround(0.3 / dt)), dt);
            EXPECT_LT((test::linear_momentum(world, 0) - 0.12 * F).norm(), 1e-9) << dt;
        }
}

TEST(BodyLoads, AnAccelerationActsAsGravity) {
    for (const bool is_quadratic : {false, true}) {
        const Model box = loaded_box({0.4, 0.2, 0.2}, {3, 2, 2}, is_quadratic, free_of_drag);
        World falls({.gravity = {1, 2, -3}}), is_pushed(weightless());
        for (World* world : {&falls, &is_pushed}) {
            WorldBody body = box.at({0, 0, 0});
            body.grips = {{.nodes = nodes_of(body, [](const Eigen::Vector3d& x) { return x[0] > 0.19; })}};
            if (world == &is_pushed) body.loads = {{.kind = LoadKind::acceleration, .value = {1, 2, -3}}};
            world->add_body(std::move(body));
            run_steps(*world, 40, 5e-3);
        }
        const Nodes way = falls.state(0).x - box.at({0, 0, 0}).state.x;
        EXPECT_GT(way.norm(), 1e-3);
        EXPECT_LT((falls.state(0).x - is_pushed.state(0).x).norm(), 1e-4 * way.norm());
    }
}

TEST(BodyLoads, GravityFollowsItsKeys) {
    for (const double dt : {2e-3, 1e-2}) {
        WorldConfig config;
        config.gravity_keys = {.times = {0.02, 0.1, 0.16, 0.2},
                               .values = {{0, 0, 0}, {1, 2, 3}, {1, 2, 3}, {0, 0, 0}}};
        World world(config);
        world.add_body(loaded_box({0.4, 0.2, 0.3}, {2, 2, 2}, false, free_of_drag).at({0, 0, 0}));
        run_steps(world, static_cast<int>(std::lround(0.3 / dt)), dt);
        const Eigen::Vector3d v = test::linear_momentum(world, 0) / world.elastic(0).mass();
        EXPECT_LT((v - 0.12 * Eigen::Vector3d(1, 2, 3)).norm(), 1e-9) << dt;
    }
}

/// With Timoshenko's share of the shear.
TEST(BodyLoads, AnEndLoadBendsACantileverAsBeamTheorySays) {
    for (const double height : {0.05, 0.1}) {
        const double L = 1, E = 1e7, P = 1e-3 * E * std::pow(height, 4) / 4;  // sags by 0.1 %
        const Model bar =
            loaded_box({L, height, height}, {20, 2, 2}, true, {.young = E, .poisson = 0, .rayleigh_mass = 0});
        World world(to_balance());
        WorldBody body = bar.at({L / 2, 0, 0});
        body.grips = {{.nodes = nodes_of(body, [](const Eigen::Vector3d& x) { return x[0] < 1e-6; })}};
        const std::vector<int> end =
            nodes_of(body, [&](const Eigen::Vector3d& x) { return x[0] > L - 1e-6; });
        body.loads = {{.kind = LoadKind::force, .value = {0, 0, -P}, .nodes = end}};
        const Nodes start = body.state.x;
        world.add_body(std::move(body));
        run_steps(world, 6, 1e3);
        const double I = std::pow(height, 4) / 12, A = height * height,
                     sag = P * L * L * L / (3 * E * I) + P * L / (5.0 / 6 * E / 2 * A);
        double mean = 0;
        for (const int node : end) mean += (start(node, 2) - world.state(0).x(node, 2)) / std::ssize(end);
        EXPECT_NEAR(mean, sag, 0.01 * sag) << height;
        const std::vector<Reaction> held = world.reactions();
        ASSERT_EQ(held.size(), 1u);
        EXPECT_NEAR(held[0].force[2], P, 1e-6 * P);
        EXPECT_NEAR(held[0].torque[1], -P * L, 1e-3 * P * L);
    }
}

TEST(BodyLoads, PressureAllAroundShrinksABlockInItsPlace) {
    const double E = 1e5;
    for (const int newton_iterations : {1, 30})
        for (const bool is_quadratic : {false, true})
            for (const double nu : {0.0, 0.3})
                for (const double share : {1e-4, 0.1, 0.3}) {
                    if (newton_iterations == 1 && share > 0.1) continue;  // see BodyLoad
                    const Model box = loaded_box({0.4, 0.2, 0.3}, {3, 2, 2}, is_quadratic,
                                                 {.young = E, .poisson = nu, .rayleigh_mass = 0});
                    World world(to_balance(newton_iterations));
                    WorldBody body = box.at({1, 2, 3}, test::turned(0.5));
                    const double p = share * E;
                    body.loads = {{.kind = LoadKind::pressure, .pressure = p}};
                    const Nodes start = body.state.x;
                    world.add_body(std::move(body));
                    run_steps(world, 12, 0.1);
                    // The corotated law has stresses linear in the stretch s: (s - 1) E / (1 - 2 nu) = -p
                    // s^2.
                    const double b = E / (1 - 2 * nu) / p, s = -b / 2 + std::sqrt(b * b / 4 + b);
                    const Eigen::RowVector3d centre(1, 2, 3);
                    const Nodes expected = (s * (start.rowwise() - centre)).rowwise() + centre;
                    EXPECT_LT((world.state(0).x - expected).norm(),
                              2e-3 * (1 - s) * (start.rowwise() - centre).norm())
                        << newton_iterations << ' ' << is_quadratic << ' ' << nu << ' ' << share;
                    EXPECT_NEAR(1 - s, p * (1 - 2 * nu) / E, 2 * share * (1 - s));
                }
}

/// A cube's surface of n x n squares a side, for a sphere.
TriMesh cube_surface(int n) {
    TriMesh cube = test::boundary_body(test::box_mesh({2, 2, 2}, {n, n, n})).surface;
    cube.X.rowwise() -= Eigen::RowVector3d(1, 1, 1);
    return cube;
}

/// A ball with a hole: triangles of a sphere, times layers, each prism cut into three.
TetMesh hollow_ball(const TriMesh& sphere, double inner, double outer, int layers) {
    const int n = sphere.X.rows();
    TetMesh mesh;
    mesh.X.resize(n * (layers + 1), 3);
    for (int k = 0; k <= layers; ++k)
        for (int v = 0; v < n; ++v)
            mesh.X.row(k * n + v) =
                (inner + (outer - inner) * k / layers) * sphere.X.row(v) / sphere.X.row(v).norm();
    mesh.T.resize(3 * sphere.F.rows() * layers, 4);
    int t = 0;
    for (int k = 0; k < layers; ++k)
        for (int f = 0; f < sphere.F.rows(); ++f) {
            std::array<int, 3> c{sphere.F(f, 0), sphere.F(f, 1), sphere.F(f, 2)};
            while (c[0] > c[1] || c[0] > c[2])
                std::rotate(c.begin(), c.begin() + 1, c.end());  // keeps its sense
            const bool is_rising = c[1] < c[2];
            const int a = k * n + c[0], b = k * n + c[1], d = k * n + c[2];
            const int A = a + n, B = b + n, D = d + n;
            if (is_rising) {
                mesh.T.row(t++) << a, b, d, D;
                mesh.T.row(t++) << a, b, D, B;
            } else {
                mesh.T.row(t++) << a, b, d, B;
                mesh.T.row(t++) << a, d, D, B;
            }
            mesh.T.row(t++) << a, B, D, A;
        }
    for (int i = 0; i < mesh.T.rows(); ++i) {  // of positive volume
        const auto x = [&](int c) { return Eigen::Vector3d(mesh.X.row(mesh.T(i, c))); };
        if ((x(1) - x(0)).cross(x(2) - x(0)).dot(x(3) - x(0)) < 0) std::swap(mesh.T(i, 2), mesh.T(i, 3));
    }
    return mesh;
}

/// Displacement of the inner surface over Lame's.
double lame_ratio(int cells, int layers, int newton_iterations) {
    const double a = 0.5, b = 1, E = 1e5, nu = 0.3, p = 1e-3 * E;
    const Body ball = test::boundary_body(make_quadratic(hollow_ball(cube_surface(cells), a, b, layers)),
                                          {.young = E, .poisson = nu, .rayleigh_mass = 0});
    WorldBody body{.elastic = std::make_shared<const ElasticBody>(ball), .W = ball.W, .F = ball.surface.F};
    BodyLoad inside{.kind = LoadKind::pressure, .pressure = p};
    for (int f = 0; f < ball.surface.F.rows(); ++f)
        if (ball.surface.X.row(ball.surface.F(f, 0)).norm() < 0.6) inside.faces.push_back(f);
    body.loads = {inside};
    World world(to_balance(newton_iterations));
    world.add_body(std::move(body));
    run_steps(world, 6, 1.0);
    double out = 0;
    int count = 0;
    for (Eigen::Index i = 0; i < ball.tets.X.rows(); ++i)
        if (const double r = ball.tets.X.row(i).norm(); std::abs(r - a) < 1e-9) {
            out += world.state(0).x.row(i).norm() - r;
            ++count;
        }
    const double lame = p * a * a * a / (E * (b * b * b - a * a * a)) *
                        ((1 - 2 * nu) * a + (1 + nu) * b * b * b / (2 * a * a));
    return out / count / lame;
}

TEST(BodyLoads, PressureInAThickSphereWidensItAsLameSays) {
    const double coarse = lame_ratio(3, 2, 1), fine = lame_ratio(6, 4, 1);
    EXPECT_NEAR(fine, 1, 0.03);
    EXPECT_LT(std::abs(fine - 1), 0.5 * std::abs(coarse - 1));
    EXPECT_NEAR(fine + (fine - coarse) / 3, 1, 0.01);  // its facets lack a share of the square of their size
    EXPECT_NEAR(lame_ratio(3, 2, 20), coarse, 1e-3);
}

TEST(BodyLoads, PressureOnTopOfABlockRestsOnTheFloor) {
    const Model box = loaded_box({0.3, 0.2, 0.2}, {3, 2, 2}, false, {.young = 1e6, .rayleigh_mass = 20});
    World world({});
    world.add_obstacle(test::floor_at(0));
    WorldBody body = box.at({0, 0, 0.1003});
    BodyLoad on_top{.kind = LoadKind::pressure, .pressure = 5000};
    for (int f = 0; f < body.F.rows(); ++f)
        if (Eigen::Vector3d(box.body.surface.X(body.F(f, 0), 2), box.body.surface.X(body.F(f, 1), 2),
                            box.body.surface.X(body.F(f, 2), 2))
                .minCoeff() > 0.099)
            on_top.faces.push_back(f);
    body.loads = {on_top};
    world.add_body(std::move(body));
    run_steps(world, 300, 5e-3);
    ASSERT_EQ(world.reactions().size(), 1u);
    const double weight = 9.81 * world.elastic(0).mass(), pressed = 5000 * 0.06;
    // The top widens by nu p / E or less.
    EXPECT_NEAR(world.reactions()[0].force[2], weight + pressed, 5e-3 * pressed);
}

/// Ten times as long as it is thick, in steps in which sound crosses it fifty times: it comes to rest.
TEST(BodyLoads, PressureAllAroundASlenderBodyMakesNoEnergy) {
    const Model bar({1, 0.1, 0.1}, {10, 2, 2}, {.young = 1e7, .rayleigh_mass = 0});
    World world({.gravity = Eigen::Vector3d::Zero()});
    WorldBody body = bar.at({0, 0, 0});
    body.grips.push_back(
        {.nodes = test::nodes_where(body.state.x, [](const Eigen::Vector3d& x) { return x.x() < -0.499; })});
    body.loads = {{.kind = LoadKind::pressure, .pressure = 1e5}};
    world.add_body(std::move(body));
    for (int step = 0; step < 100; ++step) {
        const WorldReport report = world.step(0.05);
        ASSERT_EQ(report.failure, "") << step;
        ASSERT_LT(report.kinetic_energy, step < 50 ? 1 : 0.1) << step;  // of 3 J by which it is pressed
    }
}

TEST(BodyLoads, GoOnAfterARestoreWithTheSameBits) {
    const auto made = [] {
        World world({});
        WorldBody body = loaded_box({0.4, 0.2, 0.3}, {3, 2, 2}, true, free_of_drag).at({0, 0, 0});
        const Keyed<double> ramp{.times = {0, 0.1}, .values = {0, 1}};
        body.loads = {{.kind = LoadKind::force, .value = {1, 0, 0}, .factor = ramp},
                      {.kind = LoadKind::torque, .value = {0, 0.3, 0}, .factor = ramp},
                      {.kind = LoadKind::pressure, .pressure = 3000, .factor = ramp}};
        world.add_body(std::move(body));
        return world;
    };
    World world = made(), again = made();
    run_steps(world, 10, 5e-3);
    again.restore(world.snapshot());
    for (int i = 0; i < 5; ++i) {
        run_steps(world, 1, 5e-3);
        run_steps(again, 1, 5e-3);
        EXPECT_EQ(world.state(0).x, again.state(0).x);
        EXPECT_EQ(world.state(0).v, again.state(0).v);
    }
}

TEST(BodyLoads, RefuseWhatIsWrong) {
    const Model box = loaded_box({0.4, 0.2, 0.3}, {2, 2, 2}, false, free_of_drag);
    const auto refused = [&](const BodyLoad& load) {
        World world({});
        WorldBody body = box.at({0, 0, 0});
        body.loads = {load};
        return test::refusal([&] { world.add_body(std::move(body)); });
    };
    EXPECT_EQ(refused({}), "");
    EXPECT_EQ(refused({.nodes = {0, 99}}), "load: node 99 is not in 0..26");
    EXPECT_EQ(refused({.nodes = {3, 4, 3}}), "load: node 3 is named twice");
    EXPECT_EQ(refused({.kind = LoadKind::pressure, .faces = {-1}}), "load: face -1 is not in 0..47");
    EXPECT_EQ(refused({.value = {0, NAN, 0}}), "load: it is not finite");
    EXPECT_EQ(refused({.factor = {.times = {1, 1}, .values = {0, 1}}}),
              "load: its factor needs finite values at times that increase");
    EXPECT_EQ(refused({.factor = {.times = {1, 2}, .values = {0}}}),
              "load: its factor needs a value for each time");
    EXPECT_EQ(refused({.kind = LoadKind::torque, .value = {1, 0, 0}, .nodes = {0}}),
              "load: a torque needs nodes that do not lie on one line");
    WorldConfig config;
    config.gravity_keys = {.times = {1, 0}, .values = {{0, 0, 0}, {0, 0, 1}}};
    EXPECT_EQ(test::refusal([&] { World{config}; }),
              "world: gravity needs finite values at times that increase");
}

}  // namespace
}  // namespace nbd
