#include "apps/bench/contact/momentum_balance.hpp"

#include <algorithm>

namespace nbd {
namespace {

Eigen::Vector3d momentum(const World& world, int body) {
    return world.state(body).v.transpose() * world.elastic(body).node_masses();
}

}  // namespace

MomentumBalance::MomentumBalance(const SceneSpec& spec, const World& world) : gravity_(spec.gravity) {
    for (int b = 0; b < world.body_count(); ++b)
        if (spec.bodies[static_cast<std::size_t>(b)].grips.empty() &&
            world.elastic(b).material().rayleigh_mass == 0)
            bodies_.push_back({b, momentum(world, b), 0, 0});
}

void MomentumBalance::add_step(const World& world, double dt) {
    for (Body& body : bodies_) {
        const ElasticBody& elastic = world.elastic(body.number);
        const Eigen::Vector3d now = momentum(world, body.number);
        const Eigen::Vector3d force =
            world.contact_forces(body.number).colwise().sum().transpose() + elastic.mass() * gravity_;
        const double size = world.state(body.number).v.rowwise().norm().dot(elastic.node_masses());
        body.largest = std::max(body.largest, size);
        body.difference = std::max(body.difference, (now - body.momentum - dt * force).norm());
        body.momentum = now;
    }
}

double MomentumBalance::error() const {
    double error = 0;
    for (const Body& body : bodies_)
        if (body.largest > 0) error = std::max(error, body.difference / body.largest);
    return error;
}

}  // namespace nbd
