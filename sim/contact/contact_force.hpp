#pragma once

#include <Eigen/Core>

#include "sim/contact/contact.hpp"

namespace nbd {

/// The normal impulse of a contact over a step is spring - slope n.u while that is positive, with the
/// relative velocity u of the two points at the end of the step (a minus b minus wall).
struct ContactImpulse {
    double spring = 0, slope = 0;  // N s, kg
    double normal = 0;             // the normal impulse at u, N s; 0 if the contact does not press
    bool active() const noexcept { return normal > 0; }
};

/// Penalty contact: a spring of the contact's stiffness from the end-of-step gap to `thickness`, with a
/// parallel damper, both implicit. The contact only pushes; a force that would pull is zero. Coulomb friction
/// has constant size mu times the normal force from Contact::full_slip() on and is linear in u below it.
/// thickness: metres, > 0. dt: seconds.
ContactImpulse contact_impulse(const Contact& contact, const ContactConfig& config, double thickness,
                               double dt, const Eigen::Vector3d& u) noexcept;

/// Potential of the contact, joules. Minus its gradient in u is the contact impulse with friction for the
/// normal impulse `friction_normal` (N s).
double contact_potential(const Contact& contact, const ContactConfig& config, double thickness, double dt,
                         double friction_normal, const Eigen::Vector3d& u) noexcept;

}  // namespace nbd
