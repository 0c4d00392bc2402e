// Cavities of bodies: what presses in them, and the gases that they hold, against closed forms.
#include "sim/world/cavity.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <vector>

#include "meshing/body/make_body.hpp"
#include "meshing/body/rigid_body.hpp"
#include "meshing/surface/quadratic_tets.hpp"
#include "meshing/surface/shells.hpp"
#include "meshing/surface/solid_boundary.hpp"
#include "meshing/tets/tetrahedralize.hpp"
#include "sim/world/world.hpp"
#include "tests/meshing/shapes.hpp"
#include "tests/support/error_of.hpp"

namespace nbd {
namespace {

constexpr double air = 101325;

struct HollowBall {
    double outer = 1, inner = 0.5;
    int level = 2;
    Material material{.young = 1e6, .poisson = 0.3, .rayleigh_mass = 0, .rayleigh_stiffness = 0};
    bool is_quadratic = true;
    Eigen::RowVector3d centre = Eigen::RowVector3d::Zero();

    TriMesh surface() const {
        const TriMesh ball = test::moved(test::icosphere(level), 0, 0, 0, outer);
        TriMesh both = test::joined(ball, test::moved(ball, 0, 0, 0, inner / outer));
        both.X.rowwise() += centre;
        return make_solid_boundary(both).mesh;
    }

    WorldBody body() const {
        TetMesh tets = tetrahedralize(surface()).tets;
        if (is_quadratic) tets = make_quadratic(std::move(tets));
        const Body made = make_body("ball", std::move(tets), material, 0);
        return {.elastic = std::make_shared<const ElasticBody>(made.tets, material),
                .W = made.W,
                .F = made.surface.F};
    }
};

std::vector<Shell> shells_of_body(const WorldBody& body) {
    return cavities_of(embedded(body.W, body.elastic->rest().X), body.F);
}

BodyLoad in_cavity(const WorldBody& body, double pressure) {
    return {.kind = LoadKind::pressure, .pressure = pressure, .faces = shells_of_body(body).at(0).faces};
}

BodyLoad gas_in(const WorldBody& body, const CavityGas& gas) {
    return {.kind = LoadKind::gas, .faces = shells_of_body(body).at(0).faces, .gas = gas};
}

BodyLoad from_outside(const WorldBody& body, double pressure) {
    BodyLoad load{.kind = LoadKind::pressure, .pressure = pressure};
    for (const Shell& shell : shells_of(embedded(body.W, body.elastic->rest().X), body.F))
        if (shell.volume > 0) load.faces = shell.faces;
    return load;
}

/// Steps that end in balance.
WorldConfig to_balance(int newton_iterations = 20) {
    WorldConfig config{.gravity = Eigen::Vector3d::Zero()};
    config.step = {.integrator = TimeIntegrator::backward_euler,
                   .newton_iterations = newton_iterations,
                   .newton_tolerance = 1e-6};
    config.linear.tolerance = 1e-8;
    return config;
}

/// Radial displacement at r of a hollow ball under pressures within and outside. Source: [Lame52].
double lame(const HollowBall& ball, double within, double outside, double r) {
    const double a = std::pow(ball.inner, 3), b = std::pow(ball.outer, 3), E = ball.material.young,
                 nu = ball.material.poisson;
    return ((within * a - outside * b) * (1 - 2 * nu) * r +
            (within - outside) * (1 + nu) / 2 * a * b / (r * r)) /
           (E * (b - a));
}

/// Relative change of the volume of the cavity.
double growth(const World& world, double before) { return world.cavities().at(0).volume / before - 1; }

TEST(Cavities, HaveTheVolumeOfTheirWallsAndItsDerivative) {
    for (const bool is_quadratic : {false, true})
        for (const double far : {0.0, 1e4}) {
            const HollowBall ball{.is_quadratic = is_quadratic, .centre = {far, 0, -far}};
            WorldBody body = ball.body();
            const ContactShape shape(body.W, body.F, body.elastic->rest().X);
            ASSERT_EQ(shape.cavities.size(), 1u);
            const Cavity cavity(0, *body.elastic, shape);
            Nodes x = body.elastic->rest().X;
            const double rest = cavity.volume(x);
            EXPECT_NEAR(rest, -shape.cavities[0].volume, 1e-9 * rest);
            Eigen::Matrix3d A;
            A << 1.1, 0.2, 0, 0, 0.9, 0.1, -0.1, 0, 1.3;
            const Nodes mapped = (x.rowwise() - ball.centre) * A.transpose();
            EXPECT_NEAR(cavity.volume(mapped), A.determinant() * rest, 1e-9 * rest);
            // Curved, too.
            x = mapped;
            for (Eigen::Index i = 0; i < x.rows(); ++i) x(i, 0) += 0.1 * x(i, 1) * x(i, 1);
            const Nodes slope = cavity.slope(x);
            Nodes way = x;
            for (Eigen::Index i = 0; i < x.rows(); ++i)
                way.row(i) << std::sin(7. * i), std::cos(3. * i), std::sin(5. * i);
            const double step = 1e-4;
            const double difference =
                (cavity.volume(x + step * way) - cavity.volume(x - step * way)) / (2 * step);
            EXPECT_NEAR(slope.cwiseProduct(way).sum(), difference, 1e-6 * slope.norm() * way.norm());
            EXPECT_LT(slope.colwise().sum().norm(), 1e-9);
        }
}

TEST(Cavities, APressureInThemWidensAHollowBallAsLameSays) {
    for (const double inner : {0.5, 0.8})
        for (const double size : {1e-3, 100.0}) {
            const HollowBall ball{.outer = size, .inner = inner * size};
            WorldBody body = ball.body();
            const double p = 1e-3 * ball.material.young * (1 - inner);
            body.loads = {in_cavity(body, p)};
            World world(to_balance());
            world.add_body(std::move(body));
            const double before = world.cavities().at(0).volume;
            for (int i = 0; i < 3; ++i) ASSERT_EQ(world.step(size).failure, "");
            const double expected = 3 * lame(ball, p, 0, ball.inner) / ball.inner;
            EXPECT_NEAR(growth(world, before), expected, 0.02 * expected) << inner << ' ' << size;
            EXPECT_EQ(world.cavities()[0].pressure, p);
            const Reaction told = world.reactions().at(0);
            EXPECT_EQ(told.by, ReactionBy::cavity);
            EXPECT_EQ(told.pressure, p);
            EXPECT_EQ(told.volume, world.cavities()[0].volume);
        }
}

/// Pressed from outside, a ball with a gas holds against it as its wall and the gas together.
TEST(Cavities, AGasHoldsAgainstPressureFromOutside) {
    for (const double exponent : {1.0, 1.4})
        for (const double young : {1e6, 1e4}) {  // as stiff as the gas, and far softer
            HollowBall ball{.inner = 0.8};
            ball.material.young = young;
            const double P = 1e-3 * (young + air);
            WorldBody body = ball.body();
            body.loads = {from_outside(body, P), gas_in(body, {.exponent = exponent})};
            World world(to_balance());
            world.add_body(std::move(body));
            const double before = world.cavities().at(0).volume;
            WorldReport report;
            for (int i = 0; i < 6; ++i) ASSERT_EQ((report = world.step(1)).failure, "");
            EXPECT_EQ(report.trouble, StepTrouble::none) << report.trouble_reason;
            EXPECT_LE(report.newton_iterations, 10);
            // 3 u / a with the pressure of the gas, which is linear in it.
            const double of_outside = 3 * lame(ball, 0, P, ball.inner) / ball.inner,
                         of_inside = 3 * lame(ball, 1, 0, ball.inner) / ball.inner;
            const double expected = of_outside / (1 + exponent * air * of_inside);
            EXPECT_GT(std::abs(of_outside), 1.4 * std::abs(expected)) << "the gas must matter";
            EXPECT_NEAR(growth(world, before), expected, 0.02 * std::abs(expected)) << young;
            const CavityState told = world.cavities()[0];
            EXPECT_NEAR(told.pressure + air, air * std::pow(before / told.volume, exponent), 1e-9 * air);
            EXPECT_GT(told.pressure, 0);
        }
}

/// Twice the gas in a soft balloon without a pressure outside: far beyond small strains, the wall balances
/// what the gas has left, and one linearisation a step comes to the same end as Newton's iteration.
TEST(Cavities, AGasThatIsPumpedInIsSolvedForWithoutSmallSteps) {
    std::vector<double> volumes;
    for (const int newton_iterations : {1, 30}) {
        HollowBall ball{.inner = 0.9, .is_quadratic = false};
        ball.material.young = 1e5;
        ball.material.law = MaterialLaw::stable_neo_hookean;
        WorldBody body = ball.body();
        body.loads = {gas_in(body, {.exponent = 1})};
        body.loads[0].factor = {.times = {0, 1, 2}, .values = {1, 1.3, 1.3}};
        World world(to_balance(newton_iterations));
        world.add_body(std::move(body));
        const double before = world.cavities().at(0).volume;
        for (int i = 0; i < 30; ++i) {
            const WorldReport report = world.step(0.1);
            ASSERT_EQ(report.failure, "");
            EXPECT_EQ(report.substeps, 1) << report.rejection;
        }
        const CavityState told = world.cavities()[0];
        EXPECT_NEAR((told.pressure + air) * told.volume, 1.3 * air * before, 1e-9 * air * before);
        EXPECT_GT(told.volume, 1.1 * before);
        volumes.push_back(told.volume);
    }
    EXPECT_NEAR(volumes[0], volumes[1], 1e-4 * volumes[1]);
}

/// A thin ball breathes on its gas: mass of the wall per area, stiffness of the wall and of the gas.
TEST(Cavities, AGasIsASpring) {
    std::vector<double> kept;  // shares of the amplitude
    for (const int steps : {60, 120}) {
        HollowBall ball{.outer = 1.025, .inner = 0.975, .level = 3, .is_quadratic = false};
        ball.material.young = 1e5;
        const double t = ball.outer - ball.inner, gamma = 1.4, rho = ball.material.density;
        WorldBody body = ball.body();
        body.loads = {gas_in(body, {.pressure = 1.001 * air, .exponent = gamma})};
        World world({.gravity = Eigen::Vector3d::Zero()});
        world.add_body(std::move(body));
        const double omega = std::sqrt(
            (2 * ball.material.young * t / (1 - ball.material.poisson) + 3 * gamma * air) / (rho * t));
        const double dt = 2 * std::numbers::pi / omega / steps;
        std::vector<double> pressures{world.cavities().at(0).pressure};
        for (int i = 0; i < 5 * steps; ++i) {
            ASSERT_EQ(world.step(dt).failure, "");
            pressures.push_back(world.cavities()[0].pressure);
        }
        const double middle =
            (*std::ranges::max_element(pressures) + *std::ranges::min_element(pressures)) / 2;
        std::vector<double> falls;  // times
        for (std::size_t i = 1; i < pressures.size(); ++i)
            if (pressures[i - 1] > middle && pressures[i] <= middle)
                falls.push_back(dt * (static_cast<double>(i) -
                                      (middle - pressures[i]) / (pressures[i - 1] - pressures[i])));
        ASSERT_GE(falls.size(), 4u);
        const double period = (falls[3] - falls[0]) / 3;
        EXPECT_NEAR(period, 2 * std::numbers::pi / omega, 0.03 * period);
        const double last = *std::max_element(pressures.end() - steps, pressures.end());
        kept.push_back((last - middle) / (pressures.front() - middle));
    }
    // Facets let a few hundredths of the energy go into other shapes; steps of another length damp no more.
    EXPECT_GT(kept[0], 0.9);
    EXPECT_GT(kept[1], 0.9);
    EXPECT_LT(kept[0], kept[1] + 0.04);
    EXPECT_LT(kept[0], 1.01);
}

TEST(Cavities, WithAGasKeepTheMomentumOfTheirBody) {
    HollowBall ball{.inner = 0.7, .is_quadratic = false};
    WorldBody body = ball.body();
    body.state = {body.elastic->rest().X, Nodes(body.elastic->node_count(), 3)};
    const Eigen::Vector3d spin(1, 2, -1);
    for (Eigen::Index i = 0; i < body.state.x.rows(); ++i)
        body.state.v.row(i) = spin.cross(body.state.x.row(i).transpose()) + Eigen::Vector3d(3, 0, 1);
    body.loads = {gas_in(body, {.pressure = 2 * air})};
    World world({.gravity = Eigen::Vector3d::Zero()});
    world.add_body(std::move(body));
    const Momentum before = momentum_of(world.elastic(0), world.state(0));
    for (int i = 0; i < 50; ++i) ASSERT_EQ(world.step(5e-3).failure, "");
    const Momentum after = momentum_of(world.elastic(0), world.state(0));
    EXPECT_LT((after.linear - before.linear).norm(), 1e-9 * before.linear.norm());
    EXPECT_LT((after.angular - before.angular).norm(), 1e-6 * before.angular.norm());
    EXPECT_LT(world.cavities()[0].pressure, 0.99 * air) << "it must widen";
}

TEST(Cavities, ASnapshotContinuesWithTheSameBits) {
    const HollowBall ball{.inner = 0.7, .is_quadratic = false};
    const auto make = [&] {
        World world({.gravity = Eigen::Vector3d::Zero()});
        WorldBody body = ball.body();
        body.loads = {gas_in(body, {.pressure = 1.2 * air, .exponent = 1.4})};
        world.add_body(std::move(body));
        return world;
    };
    World one = make(), other = make();
    for (int i = 0; i < 5; ++i) one.step(5e-3);
    other.restore(one.snapshot());
    for (World* world : {&one, &other})
        for (int i = 0; i < 5; ++i) world->step(5e-3);
    EXPECT_EQ(one.state(0).x, other.state(0).x);
    EXPECT_EQ(one.cavities()[0].pressure, other.cavities()[0].pressure);
}

TEST(Cavities, RefuseGasesThatCannotBe) {
    const WorldBody ball = HollowBall{.level = 1, .is_quadratic = false}.body();
    const auto refusal = [&](const std::vector<BodyLoad>& loads) {
        World world({});
        WorldBody body = ball;
        body.loads = loads;
        const std::string error = test::error_of([&] { world.add_body(std::move(body)); });
        EXPECT_EQ(world.body_count(), error.empty() ? 1 : 0);
        return error;
    };
    EXPECT_EQ(refusal({gas_in(ball, {})}), "");
    EXPECT_EQ(refusal({gas_in(ball, {}), gas_in(ball, {})}), "load: cavity 0 has a gas already");
    BodyLoad elsewhere = gas_in(ball, {});
    elsewhere.faces.pop_back();
    EXPECT_EQ(refusal({elsewhere}), "load: a gas needs the faces of one cavity of the body's surface");
    const std::string pressures =
        "load: a gas needs an absolute pressure above 0, and an ambient one of 0 or more";
    EXPECT_EQ(refusal({gas_in(ball, {.pressure = 0})}), pressures);
    EXPECT_EQ(refusal({gas_in(ball, {.ambient = -1})}), pressures);
    EXPECT_EQ(refusal({gas_in(ball, {.exponent = 0.5})}),
              "load: the exponent of a gas is 0.5, allowed: 1 to 10");
    BodyLoad drained = gas_in(ball, {});
    drained.factor = {.times = {0, 1}, .values = {1, -1}};
    EXPECT_EQ(refusal({drained}), "load: the factor of a gas, of its amount, must not be negative");
}

}  // namespace
}  // namespace nbd
