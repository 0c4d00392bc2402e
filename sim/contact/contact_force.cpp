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
    check("damping", config.damping, config.damping >= 0, ">= 0");
    check("slip_velocity", config.slip_velocity, config.slip_velocity > 0, "> 0");
    check("contacts_per_node_pair", config.per_group, config.per_group >= 0, ">= 0");
    check("iterations", config.iterations, config.iterations >= 1, ">= 1");
}

namespace {

/// The normal impulse is spring - slope n.u while that is positive.
struct NormalLaw {
    double spring, slope;  // N s, kg
};

NormalLaw normal_law(const Contact& contact, const ContactConfig& config, double thickness, double dt) {
    return {.spring = dt * contact.stiffness * (thickness - contact.gap),
            .slope = dt * contact.stiffness * (dt + config.damping)};
}

}  // namespace

double normal_impulse(const Contact& contact, const ContactConfig& config, double thickness, double dt,
                      const Eigen::Vector3d& u) noexcept {
    const NormalLaw law = normal_law(contact, config, thickness, dt);
    return std::max(law.spring - law.slope * contact.normal.dot(u), 0.0);
}

ContactImpulse contact_impulse(const Contact& contact, const ContactConfig& config, double thickness,
                               double dt, const Eigen::Vector3d& u) noexcept {
    const Eigen::Vector3d& n = contact.normal;
    const NormalLaw law = normal_law(contact, config, thickness, dt);
    const double normal_impulse = law.spring - law.slope * n.dot(u);
    if (!(normal_impulse > 0)) return {};
    const Eigen::Matrix3d normal_part = n * n.transpose();
    const double slip = (u - n.dot(u) * n).norm();
    const double drag = contact.friction * normal_impulse / std::max(slip, config.slip_velocity);
    return {.A = law.slope * normal_part + drag * (Eigen::Matrix3d::Identity() - normal_part),
            .b = law.spring * n};
}

double contact_potential(const Contact& contact, const ContactConfig& config, double thickness, double dt,
                         double friction_normal, const Eigen::Vector3d& u) noexcept {
    const Eigen::Vector3d& n = contact.normal;
    const NormalLaw law = normal_law(contact, config, thickness, dt);
    const double pressing = std::max(law.spring - law.slope * n.dot(u), 0.0);
    const double slip = (u - n.dot(u) * n).norm(), edge = config.slip_velocity;
    const double drag = slip < edge ? slip * slip / (2 * edge) : slip - edge / 2;
    return pressing * pressing / (2 * law.slope) + contact.friction * friction_normal * drag;
}

}  // namespace nbd
