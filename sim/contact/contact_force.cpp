#include "sim/contact/contact_force.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace nbd {

void check_contact_config(const ContactConfig& config) {
    const auto check = [](const char* name, double value, bool good, const char* allowed) {
        if (!good || !std::isfinite(value))
            throw std::invalid_argument(
                fmt::format("contact: {} is {}, but must be {}", name, value, allowed));
    };
    check("stiffness_scale", config.stiffness_scale, config.stiffness_scale > 0, "> 0");
    check("friction", config.friction, config.friction >= 0, ">= 0");
    check("thickness", config.thickness, config.thickness >= 0, ">= 0");
    check("tolerance", config.tolerance, config.tolerance > 0, "> 0");
}

ContactImpulse contact_impulse(const Contact& contact, double dt, const Eigen::Vector3d& u) noexcept {
    const double parting = contact.normal.dot(u);
    const BarrierLaw::Terms at = contact.barrier.at(contact.gap + dt * parting);
    const double slope = dt * dt * at.curvature, normal = -dt * at.slope;
    return {.push = normal + slope * parting, .slope = slope, .normal = normal};
}

double friction_potential(const Contact& contact, double dt, double normal,
                          const Eigen::Vector3d& u) noexcept {
    const double slip = contact.slip(u, dt).norm(), edge = contact.full_slip(dt);
    return contact.friction * normal * (slip < edge ? slip * slip / (2 * edge) : slip - edge / 2);
}

}  // namespace nbd
