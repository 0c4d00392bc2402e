#pragma once

#include <Eigen/Core>

#include "sim/contact/contact.hpp"

namespace nbd {

/// Impulse on side `a` of a contact over a step: p = b - A u, linear in the relative velocity u of the two
/// points at the end of the step (a minus b minus wall). A is symmetric positive semi-definite.
struct ContactImpulse {
    Eigen::Matrix3d A = Eigen::Matrix3d::Zero();  // kg
    Eigen::Vector3d b = Eigen::Vector3d::Zero();  // N s
    bool active() const noexcept { return A(0, 0) + A(1, 1) + A(2, 2) > 0; }
};

/// Penalty contact: a spring of the contact's stiffness from the end-of-step gap to `thickness`, with a
/// parallel damper. The contact only pushes; a force that would pull is zero. Coulomb friction has constant
/// size mu times the normal force above config.slip_velocity and is linear in u below it. Spring, damper and
/// friction are implicit, but the guess u decides between these cases and gives the normal force for
/// friction. thickness: metres, > 0. dt: seconds.
ContactImpulse contact_impulse(const Contact& contact, const ContactConfig& config, double thickness,
                               double dt, const Eigen::Vector3d& u) noexcept;

/// Potential of the contact, joules. Minus its gradient in u is the contact impulse with friction for the
/// normal impulse `friction_normal` (N s).
double contact_potential(const Contact& contact, const ContactConfig& config, double thickness, double dt,
                         double friction_normal, const Eigen::Vector3d& u) noexcept;

/// Normal impulse at u, N s; 0 if the contact does not press.
double normal_impulse(const Contact& contact, const ContactConfig& config, double thickness, double dt,
                      const Eigen::Vector3d& u) noexcept;

}  // namespace nbd
