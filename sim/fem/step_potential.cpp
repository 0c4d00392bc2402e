#include "sim/fem/step_potential.hpp"

namespace nbd {

double StepPotential::value(const Nodes& v) {
    const Material& material = body_.material();
    const auto [dt, c] = step_;
    const Nodes change = c * v - start_.v;
    Nodes product(v.rows(), 3);
    body_.mass_product(change, product);
    double sum = 0.5 * product.cwiseProduct(change).sum();
    body_.mass_product(v, product);
    sum += 0.5 * c * dt * material.rayleigh_mass * product.cwiseProduct(v).sum();
    // Relative to v*, so that the speed of a body does not drown what changes.
    const Nodes relative = v - start_.v;
    sum -= dt * (relative.transpose() * body_.node_masses()).dot(loads_.gravity);
    if (loads_.forces.rows() > 0) sum -= dt * loads_.forces.cwiseProduct(relative).sum();
    body_.damping_product(damping_, v, forces_, product);
    sum += 0.5 * c * dt * material.rayleigh_stiffness * product.cwiseProduct(v).sum();
    return sum + body_.measure(start_.x + dt * v).energy;
}

Nodes StepPotential::gradient(const Nodes& v) {
    const Material& material = body_.material();
    const auto [dt, c] = step_;
    Nodes inertia(v.rows(), 3), damping(v.rows(), 3), force(v.rows(), 3);
    body_.mass_product(c * (c + dt * material.rayleigh_mass) * v - c * start_.v -
                           (dt * loads_.gravity.transpose()).replicate(v.rows(), 1),
                       inertia);
    body_.damping_product(damping_, v, forces_, damping);
    body_.pose(start_.x + dt * v, end_, forces_);
    body_.sum_forces(forces_, force);
    if (loads_.forces.rows() > 0) force += loads_.forces;
    return inertia + dt * (c * material.rayleigh_stiffness * damping - force);
}

}  // namespace nbd
