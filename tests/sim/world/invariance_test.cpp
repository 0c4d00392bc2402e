// All terms of the equations of motion are equivariant under large rigid motions, up to rounding.
#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "sim/fem/backward_euler.hpp"
#include "sim/fem/stress.hpp"
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
        body.pose(x, pose);
        return pose;
    }
    Nodes forces_at(const Nodes& x) const {
        Nodes f(x.rows(), 3);
        body.forces(pose_of(x), f);
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
};

TEST_P(Invariance, OfForcesEnergyAndTheStateOfElements) {
    const ElementPose here = pose_of(x), there = pose_of(moved(x));
    ASSERT_GT(body.check(here).inverted, 0);
    EXPECT_EQ(body.check(there).inverted, body.check(here).inverted);
    EXPECT_EQ(body.check(there).first_inverted, body.check(here).first_inverted);
    EXPECT_NEAR(body.check(there).min_det, body.check(here).min_det, rounding);
    EXPECT_NEAR(body.energy(there), body.energy(here), rounding * body.energy(here));
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
    EXPECT_LT(body.energy(pose_of(moved(X))), rounding * rounding * body.energy(pose_of(x)));
}

TEST_P(Invariance, OfStiffnessAndItsProducts) {
    const ElementPose here = pose_of(x), there = pose_of(moved(x));
    const SparseMatrix K = body.stiffness(here), turned_K = body.stiffness(there);
    Nodes Kv(v.rows(), 3), turned_Kv(v.rows(), 3);
    body.stiffness_product(here, v, Kv);
    body.stiffness_product(there, turned(v), turned_Kv);
    EXPECT_LT((turned_Kv - turned(Kv)).norm(), rounding * Kv.norm());
    for (int i = 0; i < body.node_count(); ++i)
        for (int j = 0; j < body.node_count(); ++j) {
            if (!body.pattern().has_block(i, j)) continue;
            const Eigen::Matrix3d own = K.block(3 * i, 3 * j, 3, 3),
                                  other = turned_K.block(3 * i, 3 * j, 3, 3);
            EXPECT_LT((other - Q * own * Q.transpose()).norm(), rounding * K.norm()) << i << ' ' << j;
        }
}

TEST_P(Invariance, OfMassKineticEnergyAndMomenta) {
    Nodes Mv(v.rows(), 3), turned_Mv(v.rows(), 3);
    body.mass_product(v, Mv);
    body.mass_product(turned(v), turned_Mv);
    EXPECT_LT((turned_Mv - turned(Mv)).norm(), 1e-14 * Mv.norm());
    const double energy = kinetic_energy(body, v);
    EXPECT_NEAR(kinetic_energy(body, turned(v)), energy, 1e-14 * energy);
    const Eigen::Vector3d p = linear_momentum(body, v), L = angular_momentum(body, x, v);
    ASSERT_GT(L.norm(), 1);
    EXPECT_LT((linear_momentum(body, turned(v)) - Q * p).norm(), 1e-13 * p.norm());
    EXPECT_LT((angular_momentum(body, moved(x), turned(v)) - (Q * L + b.transpose().cross(Q * p))).norm(),
              1e-13 * b.norm() * p.norm());
}

// Combines gravity, external forces, damping, prescribed nodes and the linear solve.
TEST_P(Invariance, OfATimeStep) {
    const Loads loads{.gravity = {1, -3, -9}, .forces = test::wild_field(X, 0.5)};
    const Loads turned_loads{.gravity = Q * loads.gravity, .forces = turned(loads.forces)};
    PrescribedNodes grip;
    grip.nodes = test::nodes_where(X, [](const auto& p) { return p[0] == 0; });
    grip.v = v(grip.nodes, Eigen::all);
    const PrescribedNodes turned_grip{grip.nodes, turned(grip.v)};
    StepSystem system(body);
    BodyState here{x, v}, there{moved(x), turned(v)};
    for (int s = 0; s < 3; ++s) {
        backward_euler_step(system, here, 0.005, loads, grip, 2, 0);
        backward_euler_step(system, there, 0.005, turned_loads, turned_grip, 2, 0);
    }
    ASSERT_GT((here.x - x).norm(), 0.1);
    EXPECT_LT((there.v - turned(here.v)).norm(), 1e-8 * here.v.norm());
    EXPECT_LT((there.x - moved(here.x)).norm(), 1e-8 * (here.x - x).norm());
}

INSTANTIATE_TEST_SUITE_P(BothMasses, Invariance, ::testing::Values(MassKind::lumped, MassKind::consistent),
                         [](const auto& kind) {
                             return kind.param == MassKind::lumped ? "lumped" : "consistent";
                         });

}  // namespace
}  // namespace nbd
