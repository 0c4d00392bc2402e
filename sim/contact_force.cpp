#include "sim/contact_force.hpp"

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
    check("damping", config.damping, config.damping >= 0, ">= 0");
    check("slip_velocity", config.slip_velocity, config.slip_velocity > 0, "> 0");
    check("iterations", config.iterations, config.iterations >= 1, ">= 1");
}

ContactImpulse contact_impulse(const Contact& contact, const ContactConfig& config, double thickness,
                               double dt, const Eigen::Vector3d& u) noexcept {
    const Eigen::Vector3d& n = contact.normal;
    const double spring = dt * contact.stiffness * (thickness - contact.gap);  // impulse at u = 0
    const double slope = dt * contact.stiffness * (dt + config.damping);       // its loss per m/s
    const double normal_impulse = spring - slope * n.dot(u);
    if (!(normal_impulse > 0)) return {};
    const Eigen::Matrix3d normal_part = n * n.transpose();
    const double slip = (u - n.dot(u) * n).norm();
    const double drag = contact.friction * normal_impulse / std::max(slip, config.slip_velocity);
    return {.A = slope * normal_part + drag * (Eigen::Matrix3d::Identity() - normal_part), .b = spring * n};
}

}  // namespace nbd
