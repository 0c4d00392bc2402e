#include "sim/contact/contact_solver.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "sim/contact/contact_force.hpp"
#include "tests/support/box_body.hpp"

namespace nbd {
namespace {

class ContactForce : public testing::Test {
 protected:
    const Contact contact{.normal = {0, 0.6, 0.8},
                          .gap = 2e-3,
                          .barrier = {.reach = 4e-3, .floor = 1e-4, .stiffness = 1e5, .linear_below = 5e-4},
                          .friction = 0.4,
                          .stretch = {-8e-6, 0, 0},
                          .slip_length = 4e-5};
    static constexpr double dt = 4e-3;
};

/// The tangent of a barrier's impulse is that of its law at the end of the step.
TEST_F(ContactForce, IsThatOfTheBarrierAtTheEndOfTheStep) {
    const auto at = [&](double speed) { return contact_impulse(contact, dt, speed * contact.normal); };
    for (const double speed : {0.3, 0.0, -0.2, -0.3, -0.45, -2.0}) {
        const ContactImpulse impulse = at(speed);
        const BarrierLaw::Terms law = contact.barrier.at(2e-3 + dt * speed);
        EXPECT_NEAR(impulse.normal, -dt * law.slope, 1e-12) << speed;
        EXPECT_NEAR(impulse.push - impulse.slope * speed, impulse.normal, 1e-12 * impulse.normal) << speed;
        EXPECT_NEAR(impulse.slope, (at(speed - 1e-6).normal - at(speed + 1e-6).normal) / 2e-6,
                    1e-5 * impulse.slope)
            << speed;
    }
    EXPECT_FALSE(at(0.5).active());
}

/// Below a stretch of the slip length friction is linear; above it, mu times the normal impulse.
TEST_F(ContactForce, FrictionIsMinusTheGradientOfItsPotential) {
    const double normal = 0.7;
    const auto potential = [&](const Eigen::Vector3d& u) {
        return friction_potential(contact, dt, normal, u);
    };
    for (const double speed : {1e-3, 0.3}) {
        const Eigen::Vector3d slip(speed, 0, 0), u = slip - 0.2 * contact.normal;
        const double stretch = (dt * speed - 8e-6) / contact.slip_length;
        const double friction = contact.friction * normal * std::clamp(stretch, -1.0, 1.0);
        for (int k = 0; k < 3; ++k) {
            const Eigen::Vector3d h = 1e-6 * Eigen::Vector3d::Unit(k);
            EXPECT_NEAR(-(potential(u + h) - potential(u - h)) / 2e-6, k == 0 ? -friction : 0, 1e-6)
                << speed << ' ' << k;
        }
    }
}

/// Cubes of 1 m, one above the other, that press on each other with the corners that face each other, and the
/// lower one, if it is asked for, on a floor.
class Cubes : public testing::Test {
 protected:
    Cubes() : body_(test::box_body({1, 1, 1}, {1, 1, 1})), elastic_(body_.tets, body_.material) {
        for (int b = 0; b < 2; ++b) {
            at_.x.push_back(body_.tets.X.rowwise() + Eigen::RowVector3d(0.1 * b, 0, 1.005 * b));
            at_.centres.push_back(centre_of_mass(elastic_, at_.x.back()));
            inertia_.emplace_back(rigid_inertia(elastic_, at_.x.back()));
        }
    }

    /// What impulses do to the two, with contacts that press and have the stiffness, N/m;
    /// slip: velocity of the upper cube along x, m/s.
    ContactSolver::RigidResponse response(const std::vector<RigidVector>& impulses, double stiffness,
                                          bool floor, double slip = 0) {
        contacts_.clear();
        const auto point = [](int body, int v) {
            return SurfacePoint{.body = body, .count = 1, .vertices = {v}, .weights = {1}};
        };
        for (int v = 0; v < body_.W.rows(); ++v) {
            Contact contact{
                .normal = Eigen::Vector3d::UnitZ(),
                .gap = 0.5 * thickness,
                .barrier = {.reach = thickness, .stiffness = stiffness, .linear_below = 0.2 * thickness},
                .friction = 0.5,
                .slip_length = 1e-3 * dt};
            const Eigen::Vector3d corner = corner_at(v);
            const bool above = corner.z() > at_.centres[0].z();
            contact.a = point(0, v);
            if (above) {
                for (int w = 0; w < body_.W.rows(); ++w)  // the corner below this one
                    if ((corner - corner_at(w)).isApprox(Eigen::Vector3d::UnitZ())) contact.a = point(1, w);
                contact.b = point(0, v);
            }
            if (above || floor) contacts_.push_back(contact);
        }
        const std::vector<const ContactShape*> shapes{&shape_, &shape_};
        const int unknowns = body_.tets.X.size();
        first_unknown_ = {0, unknowns, 2 * unknowns};
        Eigen::VectorXd v = Eigen::VectorXd::Zero(2 * unknowns);
        for (int i = unknowns; i < 2 * unknowns; i += 3) v[i] = slip;
        ContactSolver solver({});
        const std::vector<TimeStep> steps(shapes.size(), dt);
        solver.begin(contacts_, {}, shapes, first_unknown_, 1e-4, steps, v, false);
        return solver.response(v, impulses, inertia_, {.starts = at_, .middles = at_, .ends = at_});
    }

    Eigen::Vector3d corner_at(int vertex) const { return embedded(body_.W, at_.x[0]).row(vertex); }
    /// The velocity of a point of the body at rest from its motion.
    Eigen::Vector3d velocity(const RigidVector& motion, std::size_t body,
                             const Eigen::Vector3d& point) const {
        const Eigen::Vector3d shift = motion.head<3>(), turn = motion.tail<3>();
        return shift + turn.cross(point - at_.centres[body]);
    }

    static constexpr double thickness = 0.01, dt = 0.01, rigid = 1e15;
    const std::vector<RigidVector> impulses_{RigidVector{1, -2, 3, 0.5, 0.4, -0.2},
                                             RigidVector{-3, 1, -2, 0.1, -0.6, 0.7}};
    Body body_;
    ElasticBody elastic_;
    ContactShape shape_{body_.W, body_.surface.F, body_.tets.X};
    BodyPositions at_;
    std::vector<std::optional<RigidMatrix>> inertia_;
    std::vector<Contact> contacts_;
    std::vector<int> first_unknown_;
};

TEST_F(Cubes, WithoutContactsMoveByTheirInertiaAlone) {
    const std::vector<RigidVector> motions = response(impulses_, 0, true).motions;
    for (std::size_t b = 0; b < 2; ++b)
        EXPECT_TRUE((*inertia_[b] * motions[b]).isApprox(impulses_[b], 1e-12)) << b;
}

TEST_F(Cubes, KeepTheSumsOfTheirMomentaWhateverTheContacts) {
    for (const double stiffness : {1e-3, 1e3, 1e9}) {
        const std::vector<RigidVector> motions = response(impulses_, stiffness, false).motions;
        Momentum given, got;
        for (std::size_t b = 0; b < 2; ++b) {
            const RigidVector own = *inertia_[b] * motions[b];
            for (auto [sum, part] : {std::pair(&given, impulses_[b]), std::pair(&got, own)}) {
                const Eigen::Vector3d linear = part.head<3>(), angular = part.tail<3>();
                sum->linear += linear;
                sum->angular += angular + at_.centres[b].cross(linear);
            }
        }
        EXPECT_TRUE(got.linear.isApprox(given.linear, 1e-9)) << stiffness;
        EXPECT_TRUE(got.angular.isApprox(given.angular, 1e-9)) << stiffness;
    }
}

TEST_F(Cubes, MoveAsOneWhereTheirContactsAreStiff) {
    const std::vector<RigidVector> motions = response(impulses_, rigid, false).motions;
    for (const double x : {-0.4, 0.5})
        for (const double y : {-0.5, 0.5}) {
            const Eigen::Vector3d corner = at_.centres[0] + Eigen::Vector3d(x, y, 0.5);
            const Eigen::Vector3d apart = velocity(motions[1], 1, corner) - velocity(motions[0], 0, corner);
            EXPECT_LT(std::abs(apart.z()), 1e-6 * motions[1].norm());
        }
}

TEST_F(Cubes, OnAFloorSlideOnlyWhereTheirFrictionSlips) {
    const RigidVector push{1, 0, -1, 0, 0, 0};
    for (const double slip : {0.0, 1.0}) {
        const std::vector<RigidVector> motions =
            response({RigidVector::Zero(), push}, rigid, true, slip).motions;
        const double mass = elastic_.mass();
        EXPECT_LT(std::abs(motions[1][2]), 1e-6 / mass) << slip;
        if (slip > 0)
            EXPECT_NEAR(motions[1][0], 0.5 / mass, 1e-6 / mass);  // the coefficient is 0.5
        else
            EXPECT_LT(std::abs(motions[1][0]), 1e-3 / mass);
    }
}

TEST_F(Cubes, GetWhatIsGivenAndTheImpulsesOfTheirContacts) {
    for (const double slip : {0.0, 1.0}) {
        const ContactSolver::RigidResponse got = response(impulses_, 1e6, true, slip);
        for (std::size_t b = 0; b < 2; ++b) {
            Eigen::Vector3d sum = impulses_[b].head<3>();
            for (int i = first_unknown_[b]; i < first_unknown_[b + 1]; i += 3)
                sum += got.impulses.segment<3>(i);
            const Eigen::Vector3d gained = elastic_.mass() * got.motions[b].head<3>();
            EXPECT_LT((gained - sum).norm(), 1e-9 * impulses_[b].norm()) << slip << ' ' << b;
        }
    }
}

TEST_F(Cubes, ThatAreHeldGetNoMotionAndHoldOthers) {
    inertia_[0].reset();
    const std::vector<RigidVector> motions =
        response({impulses_[0], {0, 0, -1, 0, 0, 0}}, rigid, false).motions;
    EXPECT_TRUE(motions[0].isZero(0));
    EXPECT_LT(motions[1].norm(), 1e-6 / elastic_.mass());
}

}  // namespace
}  // namespace nbd
