#pragma once

#include <Eigen/Geometry>

#include "sim/fem/elastic_body.hpp"
#include "sim/fem/momentum.hpp"
#include "sim/world/world.hpp"

namespace nbd::test {

/// Sum of M v over the nodes, kg m/s. v: [N, 3].
inline Eigen::Vector3d linear_momentum(const ElasticBody& body, NodesRef v) {
    return v.transpose() * body.node_masses();
}

/// Sum of x cross M v over the nodes, about the origin, kg m2/s. x, v: [N, 3].
inline Eigen::Vector3d angular_momentum(const ElasticBody& body, NodesRef x, NodesRef v) {
    const Nodes p = body.node_masses().asDiagonal() * v;
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (Eigen::Index i = 0; i < x.rows(); ++i)
        sum += Eigen::Vector3d(x.row(i)).cross(Eigen::Vector3d(p.row(i)));
    return sum;
}

/// Momentum of a body of the world, kg m/s.
inline Eigen::Vector3d linear_momentum(const World& world, int body) {
    return linear_momentum(world.elastic(body), world.state(body).v);
}

/// Angular momentum of a body of the world about a point, kg m2/s.
inline Eigen::Vector3d angular_momentum(const World& world, int body,
                                        const Eigen::Vector3d& about = Eigen::Vector3d::Zero()) {
    return angular_momentum(world.elastic(body), world.state(body).x.rowwise() - about.transpose(),
                            world.state(body).v);
}

/// Sum over all bodies, kg m/s.
inline Eigen::Vector3d linear_momentum(const World& world) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (int b = 0; b < world.body_count(); ++b) sum += linear_momentum(world, b);
    return sum;
}

/// Sum over all bodies about a point, kg m2/s.
inline Eigen::Vector3d angular_momentum(const World& world,
                                        const Eigen::Vector3d& about = Eigen::Vector3d::Zero()) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (int b = 0; b < world.body_count(); ++b) sum += angular_momentum(world, b, about);
    return sum;
}

/// Centre of mass of a body of the world, metres.
inline Eigen::Vector3d centre_of_mass(const World& world, int body) {
    return nbd::centre_of_mass(world.elastic(body), world.state(body).x);
}

}  // namespace nbd::test
