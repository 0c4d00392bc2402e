#pragma once

#include <Eigen/Geometry>

#include "sim/fem/elastic_body.hpp"

namespace nbd::test {

/// Sum of M v over the nodes, kg m/s. v: [N, 3].
inline Eigen::Vector3d linear_momentum(const ElasticBody& body, NodesRef v) {
    Nodes p(v.rows(), 3);
    body.mass_product(v, p);
    return p.colwise().sum().transpose();
}

/// Sum of x cross M v over the nodes, about the origin, kg m2/s. x, v: [N, 3].
inline Eigen::Vector3d angular_momentum(const ElasticBody& body, NodesRef x, NodesRef v) {
    Nodes p(v.rows(), 3);
    body.mass_product(v, p);
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (Eigen::Index i = 0; i < x.rows(); ++i)
        sum += Eigen::Vector3d(x.row(i)).cross(Eigen::Vector3d(p.row(i)));
    return sum;
}

}  // namespace nbd::test
