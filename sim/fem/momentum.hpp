#pragma once

#include <Eigen/Core>

#include "sim/fem/elastic_body.hpp"
#include "sim/fem/time_step.hpp"

namespace nbd {

/// Momentum of a body as a whole.
struct Momentum {
    Eigen::Vector3d linear = Eigen::Vector3d::Zero();   // kg m/s
    Eigen::Vector3d angular = Eigen::Vector3d::Zero();  // about its centre of mass, kg m2/s
};

Eigen::Vector3d centre_of_mass(const ElasticBody& body, NodesRef x);

Momentum momentum_of(const ElasticBody& body, const BodyState& state);

/// Of a body as a whole: a linear part, and one about its centre of mass.
using RigidVector = Eigen::Vector<double, 6>;
using RigidMatrix = Eigen::Matrix<double, 6, 6>;

/// Mass, kg, and moments of inertia about the centre of mass, kg m2: maps velocity and rotation, rad/s, to
/// momentum.
RigidMatrix rigid_inertia(const ElasticBody& body, NodesRef x);

/// The rate at which a body with its angular momentum would turn as a whole, rad/s.
Eigen::Vector3d angular_velocity(const ElasticBody& body, const BodyState& state);

/// Adds a rigid motion to the velocities. motion: m/s, and rad/s about the centre of mass.
void add_motion(const ElasticBody& body, const RigidVector& motion, BodyState& state);

/// Kinetic energy of the node velocities v, [N, 3] m/s, in joules.
double kinetic_energy(const ElasticBody& body, NodesRef v);

}  // namespace nbd
