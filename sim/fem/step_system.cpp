#include "sim/fem/step_system.hpp"

#include <fmt/format.h>

#include <cmath>
#include <stdexcept>

namespace nbd {

StepSystem::StepSystem(const ElasticBody& body)
    : body_(body),
      A_(body.pattern().zero_matrix()),
      b_(Eigen::VectorXd::Zero(body.unknown_count())),
      prescribed_(body.node_count(), 0),
      shift_(body.unknown_count()),
      shifted_(body.unknown_count()),
      x_(body.node_count(), 3),
      force_(body.node_count(), 3),
      product_(body.node_count(), 3) {}

void StepSystem::assemble(const BodyState& start, double dt, const Loads& loads, const Nodes& w) {
    const auto require_rows = [&](Eigen::Index rows, const char* name) {
        if (rows != body_.node_count())
            throw std::invalid_argument(
                fmt::format("step: {} has {} rows, the body has {} nodes", name, rows, body_.node_count()));
    };
    if (!(dt > 0 && std::isfinite(dt)))
        throw std::invalid_argument(fmt::format("step: dt is {} s, allowed: finite and > 0", dt));
    require_rows(start.x.rows(), "x");
    require_rows(start.v.rows(), "v");
    if (loads.forces.rows() > 0) require_rows(loads.forces.rows(), "forces");
    if (w.rows() > 0) require_rows(w.rows(), "w");

    const Nodes& iterate = w.rows() > 0 ? w : start.v;
    x_ = start.x + dt * iterate;
    body_.pose(x_, elements_);
    mass_scale_ = 1 + dt * body_.material().rayleigh_mass;
    stiffness_scale_ = dt * dt + dt * body_.material().rayleigh_stiffness;
    body_.combine(mass_scale_, stiffness_scale_, elements_, A_);

    // K w = (A w - mass_scale M w) / stiffness_scale, so one product with M covers all terms with M.
    const double share = dt * dt / stiffness_scale_;
    body_.pattern().multiply(A_, Eigen::Map<const Eigen::VectorXd>(iterate.data(), b_.size()), b_);
    b_ *= share;
    body_.mass_product((start.v - share * mass_scale_ * iterate).rowwise() + dt * loads.gravity.transpose(),
                       product_);
    body_.forces(elements_, force_);
    if (loads.forces.rows() > 0) force_ += loads.forces;
    product_ += dt * force_;
    b_ += Eigen::Map<const Eigen::VectorXd>(product_.data(), b_.size());
    std::fill(prescribed_.begin(), prescribed_.end(), 0);
}

void StepSystem::prescribe(const PrescribedNodes& prescribed) {
    const int count = static_cast<int>(prescribed.nodes.size());
    if (prescribed.v.rows() != count)
        throw std::invalid_argument(
            fmt::format("step: {} prescribed nodes, but {} velocities", count, prescribed.v.rows()));
    if (count == 0) return;
    shift_.setZero();
    for (int k = 0; k < count; ++k) {
        const int node = prescribed.nodes[k];
        if (node < 0 || node >= body_.node_count())
            throw std::invalid_argument(
                fmt::format("step: prescribed node {}, but the body has {} nodes", node, body_.node_count()));
        if (prescribed_[node])
            throw std::invalid_argument(fmt::format("step: node {} is prescribed twice", node));
        if (!prescribed.v.row(k).allFinite())
            throw std::invalid_argument(
                fmt::format("step: node {} has a non-finite prescribed velocity", node));
        prescribed_[node] = 1;
        shift_.segment<3>(3 * node) = prescribed.v.row(k).transpose();
    }
    multiply(shift_, shifted_);
    b_ -= shifted_;
    for (const int node : prescribed.nodes) {
        body_.pattern().isolate(A_, node);
        b_.segment<3>(3 * node) = shift_.segment<3>(3 * node);
    }
}

}  // namespace nbd
