#pragma once

#include <Eigen/Core>

#include "sim/contact/contact.hpp"

namespace nbd {

/// Impulse on a contact's side `a` over a step, linear in the relative velocity u of the two points at its
/// end (a minus b minus wall): p = b - A u. A is symmetric positive semi-definite.
struct ContactImpulse {
    Eigen::Matrix3d A = Eigen::Matrix3d::Zero();  // kg
    Eigen::Vector3d b = Eigen::Vector3d::Zero();  // N s
    bool active() const noexcept { return A(0, 0) + A(1, 1) + A(2, 2) > 0; }
};

/// Penalty: a spring of the contact's stiffness from the end-of-step gap to `thickness`, with a damper beside
/// it; both push only, so a contact whose force would pull is zero. Coulomb friction: of constant size
/// mu times the normal force above config.slip_velocity, linear in u below it. Both are taken implicitly;
/// which side of these cases holds, and the normal force that friction sees, come from the guess u.
/// thickness: metres, > 0. dt: seconds.
ContactImpulse contact_impulse(const Contact& contact, const ContactConfig& config, double thickness,
                               double dt, const Eigen::Vector3d& u) noexcept;

/// Its potential: minus the gradient by u is that impulse, friction taken with the normal impulse
/// `friction_normal` (N s). Joules.
double contact_potential(const Contact& contact, const ContactConfig& config, double thickness, double dt,
                         double friction_normal, const Eigen::Vector3d& u) noexcept;

/// Normal impulse at u, N s: 0 where the contact does not press.
double normal_impulse(const Contact& contact, const ContactConfig& config, double thickness, double dt,
                      const Eigen::Vector3d& u) noexcept;

}  // namespace nbd
