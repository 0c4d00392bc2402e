#include "sim/fem/step_system.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "meshing/parallel/parallel_for.hpp"

namespace nbd {
namespace {

/// How a body resists motion in a step: the share of its mass that does, and its Rayleigh coefficients.
struct Resistance {
    double inertia, drag, damping_time;  // 1, 1/s, s
};

Resistance resistance(const ElasticBody& body, const StepStart& start) noexcept {
    if (start.static_mass) return {.inertia = *start.static_mass, .drag = 0, .damping_time = 0};
    const Material& material = body.material();
    return {.inertia = 1, .drag = material.rayleigh_mass, .damping_time = material.rayleigh_stiffness};
}

}  // namespace

void add_pull(const NodeSpring& spring, const Nodes& v, Nodes& out) {
    Eigen::RowVector3d stretch = Eigen::RowVector3d::Zero();
    for (std::size_t k = 0; k < spring.nodes.size(); ++k)
        stretch += spring.factors[k] * v.row(spring.nodes[k]);
    const Eigen::RowVector3d pull = stretch * spring.A;
    for (std::size_t k = 0; k < spring.nodes.size(); ++k)
        out.row(spring.nodes[k]) += spring.factors[k] * pull;
}

StepSystem::StepSystem(const ElasticBody& body)
    : body_(body),
      A_(body.zero_matrix()),
      b_(Eigen::VectorXd::Zero(body.unknown_count())),
      prescribed_(body.node_count(), 0),
      shift_(body.unknown_count()),
      shifted_(body.unknown_count()),
      x_(body.node_count(), 3),
      impulse_(body.node_count(), 3),
      free_(body.node_count(), 3),
      image_(body.node_count(), 3) {}

void StepSystem::assemble(const StepStart& start, const TimeStep& step, const Loads& loads, const Nodes& w,
                          Tangent tangent) {
    const auto [dt, c] = step;
    const auto require_rows = [&](Eigen::Index rows, const char* name) {
        if (rows != body_.node_count())
            throw std::invalid_argument(
                fmt::format("step: {} has {} rows, the body has {} nodes", name, rows, body_.node_count()));
    };
    if (!(dt > 0 && std::isfinite(dt)))
        throw std::invalid_argument(fmt::format("step: dt is {} s, allowed: finite and > 0", dt));
    require_rows(start.x.rows(), "x");
    require_rows(start.v.rows(), "v");
    if (start.impulses.rows() > 0) require_rows(start.impulses.rows(), "impulses");
    if (loads.forces.rows() > 0) require_rows(loads.forces.rows(), "forces");
    if (w.rows() > 0) require_rows(w.rows(), "w");

    const Nodes iterate = w.rows() > 0 ? w : Nodes(start.v / c);
    x_ = start.x + dt * iterate;
    const auto [inertia, drag, damping_time] = resistance(body_, start);
    const double damping = c / dt * damping_time;
    const StepMotion motion{iterate, dt, step.strain_rate_at(), damping};
    body_.pose(x_, elements_, forces_, tangent, &motion);
    body_.sum_forces(forces_, impulse_);
    mass_scale_ = c * inertia * (1 + dt * drag);
    elastic_scale_ = dt * dt / c;
    stiffness_scale_ = elastic_scale_ * (1 + damping);
    body_.combine(mass_scale_, elastic_scale_, elements_, A_);

    impulse_ /= c;
    if (loads.forces.rows() > 0) impulse_ += dt / c * loads.forces;
    Eigen::Map<Nodes> b(b_.data(), body_.node_count(), 3);
    b = inertia * body_.mass_product(start.v) + body_.node_masses() * (dt / c * loads.gravity.transpose()) +
        impulse_;
    if (start.impulses.rows() > 0) b += start.impulses;
    double squared = 0, held_squared = 0;
    for (int i = 0; i < body_.node_count(); ++i) {
        const double mass = body_.node_masses()[i];
        Eigen::RowVector3d load = dt / c * mass * loads.gravity.transpose();
        const Eigen::RowVector3d all = impulse_.row(i) + load;
        if (loads.forces.rows() > 0) load += dt / c * loads.forces.row(i);
        squared += (load.squaredNorm() + all.squaredNorm()) / mass;
        held_squared += (load.squaredNorm() + std::pow(softness(i), 2) * all.squaredNorm()) / mass;
    }
    impulse_norm_ = std::sqrt(squared);
    yielding_norm_ = std::sqrt(held_squared);
    is_image_known_ = false;
    resistance_.clear();
    springs_.clear();
    std::fill(prescribed_.begin(), prescribed_.end(), 0);
    held_.clear();
    held_rhs_.resize(0, 3);
}

double StepSystem::softness(int node, double contacts) const noexcept {
    constexpr double enough = 100;  // what tolerances leave falls by 100 from step to step
    const double mass = body_.node_masses()[node];
    return std::min(1.0, enough * mass / (A_.diagonal()[node].trace() / 3 + contacts));
}

/// Sets free_ to v at the nodes that are not prescribed, and image_ to its product.
void StepSystem::multiply_free(const Eigen::Ref<const Eigen::VectorXd>& v) const {
    const Eigen::Index nodes = body_.node_count();
    const Eigen::Map<const Nodes> given(v.data(), nodes, 3);
    bool is_known = is_image_known_;
    for (Eigen::Index i = 0; i < nodes; ++i) {
        const Eigen::RowVector3d row =
            prescribed_[i] ? Eigen::RowVector3d::Zero() : Eigen::RowVector3d(given.row(i));
        is_known = is_known && free_.row(i) == row;
        free_.row(i) = row;
    }
    if (!is_known) body_.tangent_product(elements_, free_, forces_, image_);
    is_image_known_ = true;
}

/// Of A with free_, after multiply_free().
Nodes StepSystem::product_of_free() const {
    Nodes product = mass_scale_ * body_.mass_product(free_) + elastic_scale_ * image_;
    for (std::size_t i = 0; i < resistance_.size(); ++i) product.row(i) += free_.row(i) * resistance_[i];
    for (const NodeSpring& spring : springs_) add_pull(spring, free_, product);
    return product;
}

void StepSystem::resist(double factor, std::span<const Eigen::Matrix3d> slopes, const Nodes& w) {
    if (std::ssize(slopes) != body_.node_count() || w.rows() != body_.node_count())
        throw std::invalid_argument(fmt::format("step: {} slopes and {} velocities for {} nodes",
                                                slopes.size(), w.rows(), body_.node_count()));
    resistance_.resize(slopes.size(), Eigen::Matrix3d(Eigen::Matrix3d::Zero()));
    for (std::size_t i = 0; i < slopes.size(); ++i) {
        const Eigen::Matrix3d block = factor * slopes[i];
        resistance_[i] += block;
        A_.add(static_cast<int>(i), block);
        b_.segment<3>(3 * static_cast<Eigen::Index>(i)) += block * w.row(i).transpose();
    }
}

void StepSystem::stiffen(double factor, std::span<const NodeSpring> springs, const Nodes& w) {
    if (springs.empty()) return;
    Nodes pulls = Nodes::Zero(body_.node_count(), 3);
    for (const NodeSpring& given : springs) {
        const NodeSpring& spring =
            springs_.emplace_back(NodeSpring{given.nodes, given.factors, factor * given.A});
        add_pull(spring, w, pulls);
        for (std::size_t i = 0; i < spring.nodes.size(); ++i)
            for (std::size_t j = 0; j < spring.nodes.size(); ++j)
                if (i != j)
                    A_.add_between(spring.nodes[i], spring.nodes[j],
                                   spring.factors[i] * spring.factors[j] * spring.A);
    }
    Eigen::Map<Nodes>(b_.data(), body_.node_count(), 3) += pulls;
}

void StepSystem::multiply(const Eigen::Ref<const Eigen::VectorXd>& v, Eigen::Ref<Eigen::VectorXd> out) const {
    const Eigen::Index nodes = body_.node_count();
    const Eigen::Map<const Nodes> given(v.data(), nodes, 3);
    Eigen::Map<Nodes> result(out.data(), nodes, 3);
    multiply_free(v);
    result = product_of_free();
    for (Eigen::Index i = 0; i < nodes; ++i)
        if (prescribed_[i]) result.row(i) = given.row(i);
}

void StepSystem::add_impulses(const Nodes& impulses) {
    for (Eigen::Index i = 0; i < impulses.rows(); ++i)
        if (!prescribed_[i]) b_.segment<3>(3 * i) += impulses.row(i).transpose();
    if (held_rhs_.rows() > 0) held_rhs_ += impulses(held_, Eigen::all);
}

Nodes StepSystem::holding_impulses(const Eigen::Ref<const Eigen::VectorXd>& v) const {
    multiply_free(v);
    return product_of_free()(held_, Eigen::all) - held_rhs_;
}

void StepSystem::prescribe(const PrescribedNodes& prescribed) {
    const int count = prescribed.nodes.size();
    if (prescribed.v.rows() != count)
        throw std::invalid_argument(
            fmt::format("step: {} prescribed nodes, but {} velocities", count, prescribed.v.rows()));
    if (count == 0) return;
    shift_.setZero();
    std::vector<char> named(prescribed_.size(), 0);
    for (int k = 0; k < count; ++k) {
        const int node = prescribed.nodes[k];
        if (node < 0 || node >= body_.node_count())
            throw std::invalid_argument(
                fmt::format("step: prescribed node {}, but the body has {} nodes", node, body_.node_count()));
        if (std::exchange(named[node], 1))
            throw std::invalid_argument(fmt::format("step: node {} is prescribed twice", node));
        if (!prescribed.v.row(k).allFinite())
            throw std::invalid_argument(
                fmt::format("step: node {} has a non-finite prescribed velocity", node));
        shift_.segment<3>(3 * node) = prescribed.v.row(k).transpose();
    }
    multiply(shift_, shifted_);
    b_ -= shifted_;
    prescribed_ = std::move(named);
    held_ = prescribed.nodes;
    held_rhs_ = Eigen::Map<const Nodes>(b_.data(), body_.node_count(), 3)(held_, Eigen::all);
    for (const int node : prescribed.nodes) {
        A_.isolate(node);
        b_.segment<3>(3 * node) = shift_.segment<3>(3 * node);
    }
}

double StepPotential::value(const Nodes& v) {
    const auto [inertia, drag, damping_time] = resistance(body_, start_);
    const auto [dt, c] = step_;
    const Eigen::VectorXd& masses = body_.node_masses();
    const Nodes change = c * v - start_.v;
    Nodes product = body_.mass_product(change);
    double sum = 0.5 / c * inertia * product.cwiseProduct(change).sum();
    product = body_.mass_product(v);
    sum += 0.5 * c * dt * inertia * drag * product.cwiseProduct(v).sum();
    // Relative to the start, so that the speed of a body does not drown what changes.
    const Nodes relative = v - start_.v;
    sum -= dt / c * (relative.transpose() * masses).dot(loads_.gravity);
    if (loads_.forces.rows() > 0) sum -= dt / c * loads_.forces.cwiseProduct(relative).sum();
    if (start_.impulses.rows() > 0) sum -= start_.impulses.cwiseProduct(relative).sum();
    body_.damping_product(damping_, v, forces_, product);
    sum += 0.5 * dt * damping_time * product.cwiseProduct(v).sum();
    const Nodes x = start_.x + dt * v;
    energy_ = body_.is_rigid() ? body_.energy_by_linear_strain(damping_, x) : body_.measure(x).energy;
    return sum + energy_ / c;
}

Nodes StepPotential::gradient(const Nodes& v) {
    const auto [inertia, drag, damping_time] = resistance(body_, start_);
    const auto [dt, c] = step_;
    Nodes change = body_.mass_product(inertia * (c * (1 + dt * drag) * v - start_.v) -
                                      (dt / c * loads_.gravity.transpose()).replicate(v.rows(), 1));
    if (start_.impulses.rows() > 0) change -= start_.impulses;
    Nodes damping(v.rows(), 3), force(v.rows(), 3);
    body_.damping_product(damping_, v, forces_, damping);
    body_.pose(start_.x + dt * v, end_, forces_);
    body_.sum_forces(forces_, force);
    if (loads_.forces.rows() > 0) force += loads_.forces;
    return change + dt * (damping_time * damping - force / c);
}

void CoupledSystem::multiply(const Eigen::VectorXd& v, Eigen::VectorXd& out) const {
    const auto multiply_body = [&](int b) {
        const int first = first_unknown[b], size = first_unknown[b + 1] - first;
        systems[b].multiply(v.segment(first, size), out.segment(first, size));
    };
    parallel_for(std::ssize(systems), multiply_body, 1);
    add_couplings(v, out);
}

void CoupledSystem::add_couplings(const Eigen::VectorXd& v, Eigen::VectorXd& out) const {
    for (const Coupling& coupling : couplings) {
        if (coupling.A.isZero(0)) continue;
        Eigen::Vector3d u = Eigen::Vector3d::Zero();
        for (const CouplingTerm& t : terms_of(coupling)) u += t.weight * v.segment<3>(t.unknown);
        const Eigen::Vector3d impulse = coupling.A * u;
        for (const CouplingTerm& t : terms_of(coupling))
            if (!t.held) out.segment<3>(t.unknown) += t.weight * impulse;
    }
}

}  // namespace nbd
