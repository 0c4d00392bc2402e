#include "sim/contact/contact_force.hpp"

#include <gtest/gtest.h>

#include <algorithm>

namespace nbd {
namespace {

const Contact contact{.normal = {0, 0.6, 0.8}, .gap = 2e-3, .stiffness = 1e5, .friction = 0.4};
const ContactConfig config{.damping = 3e-3, .slip_velocity = 1e-2};
constexpr double thickness = 5e-3, dt = 4e-3;

/// A spring of 1e5 N/m, pressed by 3 mm and by 4 mm more in the step, beside a damper of 300 N s/m.
TEST(ContactForce, IsThatOfASpringAndADamperAtTheEndOfTheStep) {
    const ContactImpulse pressed = contact_impulse(contact, config, thickness, dt, -1. * contact.normal);
    EXPECT_NEAR(pressed.normal, dt * (1e5 * (3e-3 + 4e-3) + 300), 1e-9);
    const ContactImpulse parting = contact_impulse(contact, config, thickness, dt, 0.43 * contact.normal);
    EXPECT_FALSE(parting.active()) << "the spring would pull from 3 mm / (4 ms + 3 ms) on";
    EXPECT_TRUE(contact_impulse(contact, config, thickness, dt, 0.42 * contact.normal).active());
}

/// Below the slip velocity friction is linear; above it, mu times the normal impulse.
TEST(ContactForce, IsMinusTheGradientOfThePotential) {
    const double normal = 0.7;
    const auto potential = [&](const Eigen::Vector3d& u) {
        return contact_potential(contact, config, thickness, dt, normal, u);
    };
    for (const double speed : {1e-3, 0.3}) {
        const Eigen::Vector3d slip(speed, 0, 0), u = slip - 0.2 * contact.normal;
        const double drag = contact.friction * normal * std::min(speed / config.slip_velocity, 1.0);
        const Eigen::Vector3d expected =
            contact_impulse(contact, config, thickness, dt, u).normal * contact.normal -
            drag * Eigen::Vector3d::UnitX();
        for (int k = 0; k < 3; ++k) {
            const Eigen::Vector3d h = 1e-6 * Eigen::Vector3d::Unit(k);
            EXPECT_NEAR(-(potential(u + h) - potential(u - h)) / 2e-6, expected[k], 1e-6)
                << speed << ' ' << k;
        }
    }
}

}  // namespace
}  // namespace nbd
