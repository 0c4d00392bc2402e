#include "sim/backward_euler.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <stdexcept>

namespace nbd {
namespace {

// Impulse balance M (v - v0) + dt (alpha M v + beta K v - f(x) - M g - f_outer) of the nodes that are free,
// at x = x0 + dt v, whose elements are given.
double residual_norm(const StepSystem& system, const ElementPose& elements, const BodyState& start, double dt,
                     const Loads& loads, const Nodes& v) {
    const ElasticBody& body = system.body();
    const Material& material = body.material();
    Nodes inertia(v.rows(), 3), damping(v.rows(), 3), force(v.rows(), 3);
    body.mass_product((1 + dt * material.rayleigh_mass) * v - start.v -
                          (dt * loads.gravity.transpose()).replicate(v.rows(), 1),
                      inertia);
    body.stiffness_product(elements, v, damping);
    body.forces(elements, force);
    if (loads.forces.rows() > 0) force += loads.forces;
    Nodes r = inertia + dt * (material.rayleigh_stiffness * damping - force);
    for (int i = 0; i < body.node_count(); ++i)
        if (system.is_prescribed(i)) r.row(i).setZero();
    return r.norm();
}

}  // namespace

StepReport backward_euler_step(StepSystem& system, BodyState& state, double dt, const Loads& loads,
                               const PrescribedNodes& prescribed, int newton_iterations, double tolerance) {
    if (newton_iterations < 1)
        throw std::invalid_argument(
            fmt::format("step: newton_iterations is {}, allowed: >= 1", newton_iterations));
    const ElasticBody& body = system.body();
    StepReport report;
    ElementPose elements;
    Nodes v, x;
    for (int k = 0; k < newton_iterations; ++k) {
        system.assemble(state, dt, loads, v);
        const double scale = system.rhs().norm();
        system.prescribe(prescribed);
        system.factorize();
        v.resize(body.node_count(), 3);
        system.solve(system.rhs(), Eigen::Map<Eigen::VectorXd>(v.data(), v.size()));
        x = state.x + dt * v;
        body.pose(x, elements);
        const double residual = residual_norm(system, elements, state, dt, loads, v);
        report.newton_iterations = k + 1;
        report.residual = scale > 0 ? residual / scale : residual;
        if (report.residual <= tolerance) break;
    }
    report.elements = body.check(elements);
    if (report.elements.non_finite > 0)
        throw std::runtime_error(fmt::format("step: tetrahedron {} ends at positions that are not finite",
                                             report.elements.first_non_finite));
    state.x.swap(x);
    state.v.swap(v);
    return report;
}

double kinetic_energy(const ElasticBody& body, NodesRef v) {
    Nodes p(v.rows(), 3);
    body.mass_product(v, p);
    return 0.5 * p.cwiseProduct(v).sum();
}

Eigen::Vector3d linear_momentum(const ElasticBody& body, NodesRef v) {
    Nodes p(v.rows(), 3);
    body.mass_product(v, p);
    return p.colwise().sum().transpose();
}

Eigen::Vector3d angular_momentum(const ElasticBody& body, NodesRef x, NodesRef v) {
    Nodes p(v.rows(), 3);
    body.mass_product(v, p);
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (Eigen::Index i = 0; i < x.rows(); ++i)
        sum += Eigen::Vector3d(x.row(i)).cross(Eigen::Vector3d(p.row(i)));
    return sum;
}

}  // namespace nbd
