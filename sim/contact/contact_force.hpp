#pragma once

#include <Eigen/Core>

#include "sim/contact/contact.hpp"

namespace nbd {

/// The normal impulse of a contact over a step, and its tangent, push - slope n.u, in the relative velocity
/// u of the two points at the end of the step (a minus b minus wall).
struct ContactImpulse {
    double push = 0, slope = 0;  // N s, kg
    double normal = 0;           // the normal impulse at u, N s; 0 if the contact does not press
    bool active() const noexcept { return normal > 0; }
};

/// What the barrier of a contact does at u. dt: seconds.
ContactImpulse contact_impulse(const Contact& contact, double dt, const Eigen::Vector3d& u) noexcept;

/// Potential of the friction of a contact, joules: minus its gradient in u is the impulse of Coulomb friction
/// for the normal impulse `normal` (N s), mu times that from Contact::full_slip() on and linear in u below
/// it.
double friction_potential(const Contact& contact, double dt, double normal,
                          const Eigen::Vector3d& u) noexcept;

}  // namespace nbd
