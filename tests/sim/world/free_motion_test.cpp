// Closed forms that hold at every size, step and stiffness, whatever else is in the world.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "tests/sim/support/momentum.hpp"
#include "tests/sim/world/box_model.hpp"
#include "tests/support/box_mesh.hpp"
#include "tests/support/on_threads.hpp"

namespace nbd {
namespace {

using test::angular_momentum;
using test::centre_of_mass;
using test::linear_momentum;
using test::Model;

std::shared_ptr<const ElasticBody> elastic_of(const Model& box, double young, double stiffness_damping = 0,
                                              MaterialLaw law = MaterialLaw::corotated) {
    Material material = box.body.material;
    material.young = young;
    material.law = law;
    material.rayleigh_mass = 0;
    material.rayleigh_stiffness = stiffness_damping;
    return std::make_shared<const ElasticBody>(box.body.tets, material);
}

/// A world of a cube of this size, and far from it one a hundred times as large at 100 m/s.
struct BesideAGiant {
    Model box, giant;
    World world;

    BesideAGiant(double size, double young, const WorldConfig& config, const Eigen::Vector3d& at,
                 std::vector<Grip> grips = {}, double damping = 0)
        : box({size, size, size}, {2, 2, 2}),
          giant({100 * size, 100 * size, 100 * size}, {2, 2, 2}),
          world(config) {
        WorldBody small = box.at(at),
                  large = giant.at(at + Eigen::Vector3d(0, 1e3 * size, 0), test::turned(0.3), {100, 0, 0});
        small.elastic = elastic_of(box, young, damping);
        small.grips = std::move(grips);
        large.elastic = elastic_of(giant, young);
        world.add_body(std::move(small));
        world.add_body(std::move(large));
    }
};

TEST(FreeMotion, ABodyFallsAsBackwardEulerSaysAtEverySizeStepAndStiffness) {
    for (const double size : {0.01, 0.2, 10.0})
        for (const double dt : {1e-4, 2e-3, 2e-2})
            for (const double young : {1e4, 1e9})
                for (const double far : {0.0, 1e6}) {
                    BesideAGiant scene(size, young, {}, {far, 0, 0});
                    World& world = scene.world;
                    const Eigen::Vector3d start = centre_of_mass(world, 0);
                    constexpr int steps = 20;
                    int iterations = 0;
                    for (int s = 0; s < steps; ++s) {
                        const WorldReport report = world.step(dt);
                        // At 1000 km, rounded positions strain small bodies.
                        ASSERT_EQ(report.failure + report.rejection + (far == 0 ? report.fallback : ""), "")
                            << size << ' ' << dt << ' ' << young << ' ' << far;
                        iterations += report.solver_iterations;
                    }
                    const double fallen = start[2] - centre_of_mass(world, 0)[2],
                                 truth = 9.81 * dt * dt * steps * (steps + 1) / 2;
                    // Coordinates of 1000 km are multiples of 1e-10 m.
                    EXPECT_NEAR(fallen, truth, 1e-6 * truth + 3e-16 * steps * far)
                        << size << ' ' << dt << ' ' << young << ' ' << far;
                    if (far == 0) {
                        EXPECT_LE(iterations, 2) << size << ' ' << dt << ' ' << young;
                    }
                }
}

TEST(FreeMotion, APinnedBlockSagsAsInStaticsBesideAGiant) {
    for (const double size : {0.01, 0.2, 10.0}) {
        const Model box({size, size, size}, {2, 2, 2});
        const Nodes& X = box.body.tets.X;
        const Grip top{.nodes =
                           test::nodes_where(X, [&](const auto& p) { return p[2] == X.col(2).maxCoeff(); })};
        const auto bottom = test::nodes_where(X, [&](const auto& p) { return p[2] == X.col(2).minCoeff(); });
        const double young = 1e5 * size;
        double sags[2];
        for (const bool alone : {true, false}) {
            WorldConfig config;
            config.linear.solver = alone ? LinearSolver::direct : LinearSolver::iterative;
            BesideAGiant scene(size, young, config, {0, 0, 0}, {top}, 0.06 * std::sqrt(size));
            const double dt = alone ? 1e3 : 0.02;  // a long step ends in balance
            for (int s = 0; s < (alone ? 5 : 400); ++s) ASSERT_EQ(scene.world.step(dt).failure, "");
            double sag = 0;
            for (const int node : bottom) sag += X(node, 2) - scene.world.state(0).x(node, 2);
            sags[alone ? 0 : 1] = sag / static_cast<double>(bottom.size());
        }
        ASSERT_GT(sags[0], 1e-3 * size);
        EXPECT_NEAR(sags[1], sags[0], 1e-3 * sags[0]) << size;
    }
}

class SpinOfEveryLaw : public ::testing::TestWithParam<MaterialLaw> {};
INSTANTIATE_TEST_SUITE_P(Laws, SpinOfEveryLaw, ::testing::ValuesIn(material_laws),
                         [](const auto& test) { return std::string(name(test.param)); });

/// A bar that tumbles about no axis of its own; the rate in rad/s is for its ends.
TEST_P(SpinOfEveryLaw, AFreeBodyKeepsItsAngularMomentumWhateverTheDamping) {
    const Model bar({0.6, 0.2, 0.1}, {4, 2, 1});
    for (const double damping : {0.0, 1e-3, 0.1})
        for (const Tangent tangent : {Tangent::rotated, Tangent::full})
            for (const TimeIntegrator integrator : {TimeIntegrator::backward_euler, TimeIntegrator::bdf2})
                for (const double angle : {0.01, 0.1}) {  // a step
                    WorldConfig config{.gravity = {0, 0, -9.81}};
                    config.step.tangent = tangent;
                    config.step.integrator = integrator;
                    World world(config);
                    WorldBody body = bar.at({0, 0, 0});
                    body.elastic = elastic_of(bar, 1e6, damping, GetParam());
                    const double dt = 2e-3;
                    const Eigen::Vector3d rate = angle / dt * Eigen::Vector3d(0.1, 1, 0.3).normalized();
                    for (Eigen::Index i = 0; i < body.state.v.rows(); ++i)
                        body.state.v.row(i) = rate.cross(Eigen::Vector3d(body.state.x.row(i)));
                    world.add_body(std::move(body));
                    const Momentum before = momentum_of(world.elastic(0), world.state(0));
                    for (int s = 0; s < 1000; ++s) ASSERT_EQ(world.step(dt).failure, "");
                    const Momentum after = momentum_of(world.elastic(0), world.state(0));
                    EXPECT_LT((after.angular - before.angular).norm(), 1e-4 * before.angular.norm())
                        << damping << ' ' << angle;
                }
}

/// About the axis of the largest moment of inertia, where a spin is steady.
TEST_P(SpinOfEveryLaw, DampingOfStiffnessLeavesASpinAlone) {
    const Model bar({0.6, 0.3, 0.1}, {4, 2, 1});
    for (const double damping : {0.0, 0.1}) {
        WorldConfig config{.gravity = Eigen::Vector3d::Zero()};
        World world(config);
        WorldBody body = bar.at({0, 0, 0});
        body.elastic = elastic_of(bar, 1e7, damping, GetParam());
        const double dt = 2e-3;
        for (Eigen::Index i = 0; i < body.state.v.rows(); ++i)
            body.state.v.row(i) =
                Eigen::Vector3d(0, 0, 0.02 / dt).cross(Eigen::Vector3d(body.state.x.row(i)));
        world.add_body(std::move(body));
        double settled = 0, energy = 0;
        for (int s = 0; s < 1000; ++s) {
            const WorldReport report = world.step(dt);
            energy = report.kinetic_energy + report.elastic_energy;
            if (s == 500) settled = energy;
        }
        ASSERT_GT(settled, 1);
        EXPECT_NEAR(energy, settled, 1e-4 * settled) << damping;
    }
}

TEST(FreeMotion, BodiesThatCollideKeepTheirMomenta) {
    for (const double dt : {5e-4, 5e-3})
        for (const double friction : {0.0, 0.5}) {
            WorldConfig config{.gravity = Eigen::Vector3d::Zero()};
            config.contact.friction = friction;
            World world(config);
            test::add_colliding_boxes(world);
            const Eigen::Vector3d p = linear_momentum(world), p0 = linear_momentum(world, 0),
                                  L = angular_momentum(world), L0 = angular_momentum(world, 0);
            double energy = 0;
            for (int s = 0; s * dt < 0.5; ++s) {
                const WorldReport report = world.step(dt);
                ASSERT_EQ(report.failure, "");
                const double now = report.kinetic_energy + report.elastic_energy;
                if (s == 0) energy = now;
                EXPECT_LE(now, energy * (1 + 1e-6));
            }
            ASSERT_GT((linear_momentum(world, 0) - p0).norm(), 0.2 * p0.norm());
            ASSERT_GT((angular_momentum(world, 0) - L0).norm(), 0.01 * L0.norm());
            EXPECT_LT((linear_momentum(world) - p).norm(), 1e-9 * p0.norm());
            EXPECT_LT((angular_momentum(world) - L).norm(), 1e-3 * (angular_momentum(world, 0) - L0).norm())
                << dt << ' ' << friction;
        }
}

}  // namespace
}  // namespace nbd
