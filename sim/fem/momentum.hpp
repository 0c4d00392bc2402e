#pragma once

#include <Eigen/Core>

#include "sim/fem/body_state.hpp"
#include "sim/fem/elastic_body.hpp"

namespace nbd {

/// Momentum of a body as a whole.
struct Momentum {
    Eigen::Vector3d linear = Eigen::Vector3d::Zero();   // kg m/s
    Eigen::Vector3d angular = Eigen::Vector3d::Zero();  // about its centre of mass, kg m2/s
};

Eigen::Vector3d centre_of_mass(const ElasticBody& body, NodesRef x);

Momentum momentum_of(const ElasticBody& body, const BodyState& state);

/// Adds to the velocities the rigid motion that gives the body this momentum.
void set_momentum(const ElasticBody& body, const Momentum& momentum, BodyState& state);

}  // namespace nbd
