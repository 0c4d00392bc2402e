// Rigid bodies against closed forms.
#include "meshing/body/rigid_body.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <memory>
#include <tuple>

#include "sim/fem/momentum.hpp"
#include "sim/world/world.hpp"
#include "tests/meshing/shapes.hpp"
#include "tests/sim/world/box_model.hpp"

namespace nbd {
namespace {

using test::floor_at;
using test::Model;
using test::turned;

/// A box of this size, counted from its centre.
Model rigid_box(const Eigen::Vector3d& size, double density = 1000, int cells = 2) {
    TriMesh box = test::box(size[0], size[1], size[2], cells);
    box.X.rowwise() -= size.transpose() / 2;
    return Model(make_rigid_body("box", std::move(box), density), true);
}

WorldBody placed(const Model& model, const Eigen::Vector3d& at, const Eigen::Matrix3d& R,
                 const Eigen::Vector3d& velocity, const Eigen::Vector3d& spin) {
    WorldBody body = model.at(at, R, velocity);
    for (Eigen::Index i = 0; i < body.state.x.rows(); ++i)
        body.state.v.row(i) += spin.cross(body.state.x.row(i).transpose() - at).transpose();
    return body;
}

/// The rotation of a rigid body from its rest pose.
Eigen::Matrix3d rotation(const World& world, int body) {
    const Eigen::Matrix3d F = world.elastic(body).deformation_gradient(world.state(body).x, 0);
    const Eigen::JacobiSVD<Eigen::Matrix3d> svd(F, Eigen::ComputeFullU | Eigen::ComputeFullV);
    return svd.matrixU() * svd.matrixV().transpose();
}

double strain(const World& world, int body) {
    const Eigen::Matrix3d F = world.elastic(body).deformation_gradient(world.state(body).x, 0);
    return (F.transpose() * F - Eigen::Matrix3d::Identity()).norm();
}

Eigen::Vector3d centre(const World& world, int body) {
    return centre_of_mass(world.elastic(body), world.state(body).x);
}

TEST(RigidBody, HasVolumeCentreAndInertiaOfItsSolid) {
    const Eigen::Vector3d size(0.3, 0.02, 0.1);
    const Eigen::Matrix3d R = Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, -1).normalized()).matrix();
    TriMesh box = test::box(size[0], size[1], size[2], 1);
    const Eigen::Vector3d middle = R * size / 2 + Eigen::Vector3d(0.4, -2, 1);
    box.X = (box.X * R.transpose()).rowwise() + Eigen::RowVector3d(0.4, -2, 1);
    const Body body = make_rigid_body("box", box, 2500);
    const ElasticBody elastic(body);
    const double mass = 2500 * size.prod();
    EXPECT_NEAR(elastic.mass(), mass, 1e-12 * mass);
    EXPECT_LT((centre_of_mass(elastic, elastic.rest().X) - middle).norm(), 1e-12);
    Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();
    for (int k = 0; k < 3; ++k) inertia(k, k) = mass / 12 * (size.squaredNorm() - size[k] * size[k]);
    inertia = (R * inertia * R.transpose()).eval();
    const Eigen::Matrix3d found = rigid_inertia(elastic, elastic.rest().X).bottomRightCorner<3, 3>();
    EXPECT_LT((found - inertia).norm(), 1e-10 * inertia.norm());
    EXPECT_GE(Eigen::MatrixXd(body.W).minCoeff(), 0);
}

TEST(RigidBody, LacksWhatACavityHolds) {
    TriMesh shell = test::box(1, 1, 1, 2);
    const TriMesh cavity = test::box(0.5, 0.5, 0.5, 2);
    const Eigen::Index vertices = shell.X.rows(), faces = shell.F.rows();
    shell.X.conservativeResize(vertices + cavity.X.rows(), 3);
    shell.X.bottomRows(cavity.X.rows()) = cavity.X.rowwise() + Eigen::RowVector3d(0.25, 0.25, 0.25);
    shell.F.conservativeResize(faces + cavity.F.rows(), 3);
    shell.F.bottomRows(cavity.F.rows()) = cavity.F.rowwise().reverse().array() + static_cast<int>(vertices);
    const ElasticBody elastic(make_rigid_body("shell", shell, 1000));
    EXPECT_NEAR(elastic.mass(), 875, 1e-9);
    const double inertia = 1000.0 / 6 - 125 * 0.25 / 6;
    EXPECT_NEAR(rigid_inertia(elastic, elastic.rest().X)(3, 3), inertia, 1e-9 * inertia);
}

TEST(RigidBody, RefusesWhatHasNoVolume) {
    TriMesh flat = test::box(1, 1, 1, 1);
    flat.X.col(2).setZero();
    EXPECT_THROW(make_rigid_body("flat", flat, 1000), std::invalid_argument);
    TriMesh inside_out = test::box(1, 1, 1, 1);
    inside_out.F.col(1).swap(inside_out.F.col(2));
    EXPECT_THROW(make_rigid_body("inside out", inside_out, 1000), std::invalid_argument);
    EXPECT_THROW(make_rigid_body("none", test::box(1, 1, 1, 1), 0), std::invalid_argument);
}

TEST(RigidBody, HasTheInertiaThatItIsGiven) {
    const Eigen::Matrix3d R = Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, -1).normalized()).matrix();
    for (const double size : {1e-3, 1.0, 100.0})
        for (const double far : {0.0, 1e6}) {
            TriMesh box = test::box(size, 0.6 * size, 0.3 * size, 1);
            const Eigen::Vector3d at(far, -far, far), centre = at + size * Eigen::Vector3d(0.4, 0.1, 0.2);
            box.X.rowwise() += at.transpose();
            const double mass = 7;
            const Eigen::Matrix3d moments =
                mass * size * size * R * Eigen::Vector3d(0.02, 0.03, 0.045).asDiagonal() * R.transpose();
            const Eigen::Matrix3d symmetric = (moments + moments.transpose()) / 2;
            const Body body =
                make_rigid_body("box", box, {.mass = mass, .centre = centre, .moments = symmetric});
            const ElasticBody elastic(body);
            EXPECT_NEAR(elastic.mass(), mass, 1e-12 * mass);
            const double rounding = 1e-10 * size + 1e-15 * far;
            EXPECT_LT((centre_of_mass(elastic, elastic.rest().X) + body.origin - centre).norm(), rounding);
            const Eigen::Matrix3d found = rigid_inertia(elastic, elastic.rest().X).bottomRightCorner<3, 3>();
            EXPECT_LT((found - symmetric).norm(), (1e-9 + 10 * rounding / size) * symmetric.norm());
            // Spread evenly where no moments are given.
            const Eigen::Vector3d sides(size, 0.6 * size, 0.3 * size);
            const ElasticBody even(make_rigid_body("box", box, {.mass = mass}));
            for (int k = 0; k < 3; ++k) {
                const double moment = mass / 12 * (sides.squaredNorm() - sides[k] * sides[k]);
                EXPECT_NEAR(rigid_inertia(even, even.rest().X)(3 + k, 3 + k), moment,
                            (1e-9 + 10 * rounding / size) * moment);
            }
        }
}

TEST(RigidBody, RefusesAnInertiaThatNoMassHas) {
    const TriMesh box = test::box(1, 1, 1, 1);
    const auto refuses = [&](const RigidInertia& inertia) {
        EXPECT_THROW(make_rigid_body("box", box, inertia), std::invalid_argument);
    };
    refuses({.mass = 0});
    refuses({.mass = 1, .centre = Eigen::Vector3d(5, 0, 0)});
    for (const Eigen::Vector3d& moments :
         {Eigen::Vector3d(0, 0, 0), {0.1, 0.1, -0.1}, {0.1, 0.1, 0.3}, {5, 5, 5}, {0.1, 0.1, NAN}})
        refuses({.mass = 1, .moments = Eigen::Matrix3d(moments.asDiagonal())});
    Eigen::Matrix3d askew = Eigen::Vector3d(0.1, 0.1, 0.1).asDiagonal();
    askew(0, 1) = 0.01;
    refuses({.mass = 1, .moments = askew});
}

/// Size, step, angular velocity, distance from the origin.
class Tumbling : public ::testing::TestWithParam<std::tuple<double, double, double, double>> {};

/// Rotates as Euler's equations say, integrated by the rule of Runge and Kutta.
TEST_P(Tumbling, FollowsEulersEquations) {
    const auto [size, dt, speed, far] = GetParam();
    const Model box = rigid_box(size * Eigen::Vector3d(1, 0.6, 0.3));
    World world({.gravity = Eigen::Vector3d::Zero()});
    const Eigen::Vector3d spin = speed * Eigen::Vector3d(0.1, 1, 0.2), at(far, -far, far);
    world.add_body(placed(box, at, Eigen::Matrix3d::Identity(), {size, 0, 0}, spin));
    const Eigen::Matrix3d inertia =
        rigid_inertia(world.elastic(0), world.elastic(0).rest().X).bottomRightCorner<3, 3>();
    const auto moving = [&] { return momentum_of(world.elastic(0), world.state(0)).angular; };
    const Eigen::Vector3d L = moving();
    EXPECT_LT((L - inertia * spin).norm(), 1e-9 * L.norm());
    Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
    constexpr int steps = 100, parts = 20;
    for (int s = 0; s < steps; ++s) {
        const WorldReport report = world.step(dt);
        ASSERT_TRUE(test::is_balanced(report)) << report.rejection << report.failure;
        for (int k = 0; k < parts; ++k) {
            const double h = dt / parts;
            const auto rate = [&](const Eigen::Matrix3d& at_R) -> Eigen::Matrix3d {
                const Eigen::Vector3d w = at_R * inertia.inverse() * at_R.transpose() * L;
                Eigen::Matrix3d cross;
                cross << 0, -w.z(), w.y(), w.z(), 0, -w.x(), -w.y(), w.x(), 0;
                return cross * at_R;
            };
            const Eigen::Matrix3d a = rate(R), b = rate(R + h / 2 * a), c = rate(R + h / 2 * b),
                                  d = rate(R + h * c);
            R += h / 6 * (a + 2 * b + 2 * c + d);
        }
    }
    EXPECT_LT((moving() - L).norm(), 1e-6 * L.norm());
    const double angle = steps * dt * speed;
    EXPECT_LT((rotation(world, 0) - R).norm(), 0.02 * std::max(1.0, angle)) << angle;
    // Far away, rounded positions strain a body that is so stiff.
    EXPECT_LT((centre(world, 0) - at - Eigen::Vector3d(steps * dt * size, 0, 0)).norm(),
              size * (far > 0 ? 1e-3 : 1e-5));
    EXPECT_LT(strain(world, 0), 1e-3);
}

INSTANTIATE_TEST_SUITE_P(Range, Tumbling,
                         ::testing::Values(std::tuple(0.1, 5e-3, 10.0, 0.0),
                                           std::tuple(0.01, 1e-3, 30.0, 0.0),
                                           std::tuple(10.0, 2e-2, 2.0, 0.0),
                                           std::tuple(0.1, 1e-4, 200.0, 0.0), std::tuple(0.1, 2e-2, 3.0, 1e3),
                                           std::tuple(10.0, 1e-4, 1.0, 1e3)));

/// What turns by a radian and more in a step is cut into parts, and keeps its energy.
TEST(RigidBody, SpinsFastWithoutGainingEnergy) {
    for (const double turn : {0.4, 0.8, 2.0}) {
        const Model box = rigid_box({0.2, 0.04, 0.04});
        World world({.gravity = Eigen::Vector3d::Zero()});
        constexpr double dt = 5e-3;
        world.add_body(placed(box, {0, 0, 0}, Eigen::Matrix3d::Identity(), {0, 0, 0}, {0, 0.01, turn / dt}));
        const auto kinetic = [&] { return kinetic_energy(world.elastic(0), world.state(0).v); };
        const double begin = kinetic();
        double settled = 0;
        for (int s = 0; s < 200; ++s) {
            ASSERT_TRUE(world.step(dt).failure.empty());
            if (s == 5) settled = kinetic();
        }
        // The velocities of a step are those of its straight way, which leads inward, too.
        EXPECT_NEAR(settled, begin, 0.05 * begin) << turn;
        EXPECT_NEAR(kinetic(), settled, 0.01 * settled) << turn;
    }
}

/// Plates, needles and cubes, and one whose mass lies in a corner, that fall onto their corners, tip over and
/// roll about gain no energy, in steps from short to long for their size.
TEST(RigidBody, GainsNoEnergyWhereItTipsOver) {
    for (const auto& [size, dt] :
         {std::pair(0.02, 5e-3), {0.02, 2e-2}, {0.1, 1e-2}, {0.1, 2e-2}, {5.0, 2e-2}})
        for (const Eigen::Vector3d& shape :
             {Eigen::Vector3d(1, 1, 0.05), {1, 0.7, 0.1}, {1, 0.05, 0.05}, {1, 1, 1}})
            for (const bool is_loaded : {false, true})
                for (int k = 0; k < 3; ++k) {
                    TriMesh box = test::box(size * shape[0], size * shape[1], size * shape[2], 2);
                    box.X.rowwise() -= size * shape.transpose() / 2;
                    RigidInertia inertia{.mass = 1};
                    if (is_loaded) inertia.centre = 0.4 * size * shape;
                    const Model model(make_rigid_body("box", std::move(box), inertia), true);
                    World world({.gravity = {0, 0, -9.81}});
                    const Eigen::Vector3d axis = Eigen::Vector3d(1, 0.7 * k, 0.4 - 0.3 * k).normalized();
                    world.add_body(placed(model, {0, 0, 1.1 * size},
                                          Eigen::AngleAxisd(1.4 + 0.5 * k, axis).matrix(), {0, 0, 0},
                                          {0, 0, 3.0 * k}));
                    world.add_obstacle(floor_at(0, 0.8));
                    double first = 0, most = 0;
                    for (int step = 0; step < 80; ++step) {
                        const WorldReport report = world.step(dt);
                        ASSERT_EQ(report.failure, "");
                        const double energy =
                            report.kinetic_energy + report.elastic_energy + report.gravity_energy;
                        if (step == 0) first = energy;
                        most = std::max(most, energy);
                    }
                    EXPECT_LT(most, 1.05 * first)
                        << size << ' ' << dt << ' ' << shape.transpose() << ' ' << is_loaded << ' ' << k;
                }
}

/// A torque spins a body up, however far it turns in a step.
TEST(RigidBody, SpinsUpUnderATorque) {
    for (const auto& [integrator, dt] : {std::pair(TimeIntegrator::backward_euler, 5e-3),
                                         {TimeIntegrator::backward_euler, 2e-2},
                                         {TimeIntegrator::second_order, 5e-3},
                                         {TimeIntegrator::second_order, 2e-2}}) {
        const Model box = rigid_box({0.3, 0.2, 0.1});
        World world({.gravity = Eigen::Vector3d::Zero(), .step = {.integrator = integrator}});
        world.add_body(box.at({0, 0, 0}));
        constexpr double rate = 20;  // rad/s2
        const Eigen::Matrix3d inertia =
            rigid_inertia(world.elastic(0), world.state(0).x).bottomRightCorner<3, 3>();
        for (double time = 0; time < 1 - dt / 2; time += dt) {
            const Nodes& x = world.state(0).x;  // forces whose sum is 0 and whose torque is about z
            const Eigen::Vector3d middle = centre(world, 0), torque(0, 0, inertia(2, 2) * rate);
            Eigen::Matrix3d arms = Eigen::Matrix3d::Zero();
            const Nodes away = x.rowwise() - x.colwise().mean();
            for (Eigen::Index i = 0; i < x.rows(); ++i) {
                const Eigen::Vector3d r = away.row(i);
                arms += r.squaredNorm() * Eigen::Matrix3d::Identity() - r * r.transpose();
            }
            const Eigen::Vector3d turn = arms.ldlt().solve(torque);
            for (Eigen::Index i = 0; i < x.rows(); ++i)
                world.forces(0).row(i) = turn.cross(Eigen::Vector3d(away.row(i))).transpose();
            ASSERT_TRUE(world.step(dt).failure.empty());
            ASSERT_LT(middle.norm(), 1e-6);
        }
        EXPECT_NEAR(angular_velocity(world.elastic(0), world.state(0)).z(), rate, 0.03 * rate) << dt;
    }
}

/// Boxes that hit each other off their centres keep their momenta, in steps from short to long for their
/// turns.
TEST(RigidBody, KeepsMomentaInCollisions) {
    const Model box = rigid_box({0.3, 0.2, 0.1});
    for (const TimeIntegrator integrator : {TimeIntegrator::backward_euler, TimeIntegrator::second_order})
        for (const double dt : {5e-3, 2e-2}) {
            World world({.gravity = Eigen::Vector3d::Zero(),
                         .contact = {.friction = 0},
                         .step = {.integrator = integrator}});
            world.add_body(box.at({-0.35, 0.12, 0.02}, Eigen::Matrix3d::Identity(), {2, 0, 0}));
            world.add_body(box.at({0, 0, 0}));
            const auto whole = [&] {
                Momentum sum;
                for (int b = 0; b < 2; ++b) {
                    const Momentum one = momentum_of(world.elastic(b), world.state(b));
                    sum.linear += one.linear;
                    sum.angular += one.angular + centre(world, b).cross(one.linear);
                }
                return sum;
            };
            const Momentum begin = whole();
            for (int s = 0; s * dt < 0.5; ++s) ASSERT_EQ(world.step(dt).failure, "");
            EXPECT_GT(momentum_of(world.elastic(1), world.state(1)).linear.x(), 0.2 * begin.linear.x());
            EXPECT_LT((whole().linear - begin.linear).norm(), 1e-9 * begin.linear.norm());
            EXPECT_LT((whole().angular - begin.angular).norm(), 1e-3 * begin.angular.norm())
                << dt << ' ' << (integrator == TimeIntegrator::second_order);
        }
}

TEST(RigidBody, TipsWhereItsEdgeHoldsIt) {
    constexpr double angle = 0.35;                   // tan = 0.365
    for (const double slenderness : {0.33, 0.40}) {  // half width over half height: tips below tan(angle)
        const double height = 0.2, width = slenderness * height;
        const Model box = rigid_box({width, 0.2, height});
        const Eigen::Matrix3d R = Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitY()).matrix();
        World world(WorldConfig{});
        world.add_obstacle({.shape = PlaneShape{.normal = R.col(2)}, .friction = 2});
        world.add_body(placed(box, (height / 2 + 2e-4) * R.col(2), R, {0, 0, 0}, {0, 0, 0}));
        for (int s = 0; s < 300; ++s) world.step(5e-3);
        const bool stands = rotation(world, 0).col(2).dot(R.col(2)) > 0.999;
        EXPECT_EQ(stands, slenderness > std::tan(angle)) << slenderness;
    }
}

TEST(RigidBody, TenBoxesStand) {
    const Model box = rigid_box({0.1, 0.1, 0.1});
    World world(WorldConfig{});
    world.add_obstacle(floor_at(0));
    for (int b = 0; b < 10; ++b)
        world.add_body(placed(box, {0, 0, 0.0502 + 0.1002 * b}, turned(0), {0, 0, 0}, {0, 0, 0}));
    double settled = 0;
    for (int s = 0; s < 400; ++s) {
        const WorldReport report = world.step(5e-3);
        ASSERT_TRUE(report.failure.empty()) << report.failure;
        if (s == 99) settled = centre(world, 9).z();
    }
    EXPECT_NEAR(settled, 0.95, 2e-3);
    EXPECT_NEAR(centre(world, 9).z(), settled, 1e-5);
    EXPECT_LT(centre(world, 9).head<2>().norm(), 1e-5);
}

/// A rigid box on a soft one presses it by its weight: E A d / L = m g.
TEST(RigidBody, PressesASoftBody) {
    const Model soft({0.1, 0.1, 0.1}, {4, 4, 4}, {.young = 2e5, .poisson = 0, .rayleigh_stiffness = 1e-2}),
        heavy = rigid_box({0.1, 0.1, 0.02}, 8000);
    World world({.step = {.integrator = TimeIntegrator::backward_euler}});
    world.add_obstacle(floor_at(0, 0));
    world.add_body(soft.at({0, 0, 0.0502}));
    world.add_body(placed(heavy, {0, 0, 0.1106}, turned(0), {0, 0, 0}, {0, 0, 0}));
    for (int s = 0; s < 400; ++s) ASSERT_TRUE(world.step(5e-3).failure.empty());
    const double weight = 9.81 * heavy.elastic->mass(), own = 9.81 * soft.elastic->mass();
    const Nodes x = world.surface(0);
    const double height = x.col(2).maxCoeff() - x.col(2).minCoeff();
    const double pressed = (weight + own / 2) * 0.1 / (2e5 * 0.01);
    EXPECT_NEAR(0.1 - height, pressed, 0.03 * pressed);
    EXPECT_LT(strain(world, 1), 1e-6);
}

}  // namespace
}  // namespace nbd
