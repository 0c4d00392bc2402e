// All terms of the equations of motion are equivariant under large rigid motions, up to rounding.
#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "sim/fem/momentum.hpp"
#include "sim/fem/stress.hpp"
#include "tests/sim/support/momentum.hpp"
#include "tests/sim/support/one_body_world.hpp"
#include "tests/support/box_mesh.hpp"

namespace nbd {
namespace {

class Invariance : public ::testing::TestWithParam<MassKind> {
 protected:
    // The rigid motion x -> Q x + b.
    const Eigen::Matrix3d Q =
        Eigen::AngleAxisd(2.9, Eigen::Vector3d(2, -1, 3).normalized()).toRotationMatrix();
    const Eigen::RowVector3d b{700, -900, 400};  // metres; the body is 1 m long

    Nodes turned(const Nodes& v) const { return v * Q.transpose(); }
    Nodes moved(const Nodes& x) const { return turned(x).rowwise() + b; }
    ElementPose pose_of(const Nodes& x) const {
        ElementPose pose;
        ElementForces forces;
        body.pose(x, pose, forces);
        return pose;
    }
    Nodes forces_at(const Nodes& x) const {
        Nodes f(x.rows(), 3);
        ElementPose pose;
        ElementForces forces;
        body.pose(x, pose, forces);
        body.sum_forces(forces, f);
        return f;
    }

    const ElasticBody body{
        test::box_mesh({1, 0.6, 0.8}, {4, 3, 3}, 0.2),
        Material{.young = 2e5, .poisson = 0.3, .rayleigh_mass = 0.4, .rayleigh_stiffness = 1e-3}, GetParam()};
    const Nodes X = body.rest().X;
    const Nodes x = X + test::wild_field(X, 0.08);  // some elements inverted
    const Nodes v = test::wild_field(X, 2).rowwise() + Eigen::RowVector3d(3, 1, -2);

    // Positions near 1000 m are rounded to 1e-13 m; elements measure about 0.2 m.
    static constexpr double rounding = 1e-11;
    static constexpr double single = 1e-6;  // of what is kept in single precision
};

TEST_P(Invariance, OfForcesEnergyAndTheStateOfElements) {
    const ElementReport here = body.measure(x), there = body.measure(moved(x));
    ASSERT_GT(here.inverted, 0);
    EXPECT_EQ(there.inverted, here.inverted);
    EXPECT_EQ(there.first_inverted, here.first_inverted);
    EXPECT_NEAR(there.min_det, here.min_det, rounding);
    EXPECT_NEAR(there.energy, here.energy, rounding * here.energy);
    const Nodes f = forces_at(x);
    EXPECT_LT((forces_at(moved(x)) - turned(f)).norm(), rounding * f.norm());
}

TEST_P(Invariance, OfStress) {
    const Eigen::VectorXd here = von_mises_stress(body, x), there = von_mises_stress(body, moved(x));
    ASSERT_GT(here.minCoeff(), 0);
    EXPECT_LT((there - here).cwiseAbs().maxCoeff(), rounding * here.maxCoeff());
}

TEST_P(Invariance, OfABodyAtRest) {
    const double scale = forces_at(x).norm();
    EXPECT_LT(forces_at(moved(X)).norm(), rounding * scale);
    EXPECT_LT(body.measure(moved(X)).energy, rounding * rounding * body.measure(x).energy);
}

TEST_P(Invariance, OfStiffnessAndItsProducts) {
    const ElementPose here = pose_of(x), there = pose_of(moved(x));
    const SparseMatrix K = body.stiffness(here).to_sparse(), turned_K = body.stiffness(there).to_sparse();
    Nodes Kv(v.rows(), 3), turned_Kv(v.rows(), 3);
    ElementForces forces;
    body.stiffness_product(here, v, forces, Kv);
    body.stiffness_product(there, turned(v), forces, turned_Kv);
    EXPECT_LT((turned_Kv - turned(Kv)).norm(), rounding * Kv.norm());
    for (int i = 0; i < body.node_count(); ++i)
        for (int j = 0; j < body.node_count(); ++j) {
            if (!body.pattern().has_block(i, j)) continue;
            const Eigen::Matrix3d own = K.block(3 * i, 3 * j, 3, 3),
                                  other = turned_K.block(3 * i, 3 * j, 3, 3);
            EXPECT_LT((other - Q * own * Q.transpose()).norm(), single * K.norm()) << i << ' ' << j;
        }
}

TEST_P(Invariance, OfMassKineticEnergyAndMomenta) {
    Nodes Mv(v.rows(), 3), turned_Mv(v.rows(), 3);
    body.mass_product(v, Mv);
    body.mass_product(turned(v), turned_Mv);
    EXPECT_LT((turned_Mv - turned(Mv)).norm(), 1e-14 * Mv.norm());
    const double energy = kinetic_energy(body, v);
    EXPECT_NEAR(kinetic_energy(body, turned(v)), energy, 1e-14 * energy);
    const Eigen::Vector3d p = test::linear_momentum(body, v), L = test::angular_momentum(body, x, v);
    ASSERT_GT(L.norm(), 1);
    EXPECT_LT((test::linear_momentum(body, turned(v)) - Q * p).norm(), 1e-13 * p.norm());
    EXPECT_LT(
        (test::angular_momentum(body, moved(x), turned(v)) - (Q * L + b.transpose().cross(Q * p))).norm(),
        1e-13 * b.norm() * p.norm());
}

// Gravity, outer forces, damping, grips and the linear solve, all in one.
TEST_P(Invariance, OfATimeStep) {
    const Nodes forces = test::wild_field(X, 0.5);
    const Grip grip{.nodes = test::nodes_where(X, [](const auto& p) { return p[0] == 0; }),
                    .centre = {0.1, 0.2, 0.3},
                    .translation = {0.02, -0.01, 0.03},
                    .rotation = {0.1, 0.3, -0.2},
                    .duration = 0.02};
    Grip turned_grip = grip;
    turned_grip.centre = Q * grip.centre + b.transpose();
    turned_grip.translation = Q * grip.translation;
    turned_grip.rotation = Q * grip.rotation;
    // Two iterations do not reach the tolerance, but both worlds must get equally far.
    WorldConfig config = test::exact_steps(2), turned_config = config;
    config.gravity = {1, -3, -9};
    turned_config.gravity = Q * config.gravity;
    test::OneBodyWorld here(body, config, {x, v}, {grip});
    test::OneBodyWorld there(body, turned_config, {moved(x), turned(v)}, {turned_grip});
    here.world().forces(0) = forces;
    there.world().forces(0) = turned(forces);
    for (int s = 0; s < 3; ++s)
        for (test::OneBodyWorld* world : {&here, &there}) {
            const WorldReport report = world->world().step(0.005);
            EXPECT_EQ(report.failure, "");
            EXPECT_EQ(report.newton_iterations, 2);
        }
    const BodyState &end = here.state(), &turned_end = there.state();
    ASSERT_GT((end.x - x).norm(), 0.1);
    EXPECT_LT((turned_end.v - turned(end.v)).norm(), 1e-8 * end.v.norm());
    EXPECT_LT((turned_end.x - moved(end.x)).norm(), 1e-8 * (end.x - x).norm());
}

INSTANTIATE_TEST_SUITE_P(BothMasses, Invariance, ::testing::Values(MassKind::lumped, MassKind::consistent),
                         [](const auto& kind) {
                             return kind.param == MassKind::lumped ? "lumped" : "consistent";
                         });

}  // namespace
}  // namespace nbd
