#include "sim/fem/backward_euler.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <stdexcept>

#include "sim/fem/step_potential.hpp"

namespace nbd {
namespace {

// Impulse by which the equations of the free nodes are off, the elements being those at the end of the step.
double residual_norm(const StepSystem& system, const ElementPose& elements, const BodyState& start, double dt,
                     const Loads& loads, const Nodes& v) {
    Nodes r = StepPotential(system.body(), start, dt, loads, elements).gradient(v);
    for (int i = 0; i < r.rows(); ++i)
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
