#include "sim/fem/momentum.hpp"

namespace nbd {
namespace {

Nodes from_centre(const ElasticBody& body, NodesRef x) {
    return x.rowwise() - centre_of_mass(body, x).transpose();
}

/// r^T M u, the sum of the masses times r_i u_j^T.
Eigen::Matrix3d moments(const ElasticBody& body, const Nodes& r, const Nodes& u) {
    return r.transpose() * body.mass_product(u);
}

/// The sum of r cross M v. r: from the centre.
Eigen::Vector3d angular(const ElasticBody& body, const Nodes& r, const Nodes& v) {
    const Eigen::Matrix3d Q = moments(body, r, v);
    return {Q(1, 2) - Q(2, 1), Q(2, 0) - Q(0, 2), Q(0, 1) - Q(1, 0)};
}

Eigen::Vector3d linear(const ElasticBody& body, const Nodes& v) { return v.transpose() * body.node_masses(); }

}  // namespace

Eigen::Vector3d centre_of_mass(const ElasticBody& body, NodesRef x) {
    const Eigen::RowVector3d first = x.row(0);  // far from the origin, differences are exact
    return (first + body.node_masses().transpose() * (x.rowwise() - first) / body.mass()).transpose();
}

Momentum momentum_of(const ElasticBody& body, const BodyState& state) {
    return {linear(body, state.v), angular(body, from_centre(body, state.x), state.v)};
}

RigidMatrix rigid_inertia(const ElasticBody& body, NodesRef x) {
    const Nodes r = from_centre(body, x);
    const Eigen::Matrix3d S = moments(body, r, r);
    RigidMatrix inertia = body.mass() * RigidMatrix::Identity();
    inertia.bottomRightCorner<3, 3>() = S.trace() * Eigen::Matrix3d::Identity() - (S + S.transpose()) / 2;
    return inertia;
}

Eigen::Vector3d angular_velocity(const ElasticBody& body, const BodyState& state) {
    const Eigen::Matrix3d inertia = rigid_inertia(body, state.x).bottomRightCorner<3, 3>();
    return inertia.ldlt().solve(momentum_of(body, state).angular);
}

void add_motion(const ElasticBody& body, const RigidVector& motion, BodyState& state) {
    const Nodes r = from_centre(body, state.x);
    const Eigen::RowVector3d shift = motion.head<3>(), turn = motion.tail<3>();
    for (Eigen::Index i = 0; i < r.rows(); ++i)
        state.v.row(i) += shift + Eigen::RowVector3d(turn[1] * r(i, 2) - turn[2] * r(i, 1),
                                                     turn[2] * r(i, 0) - turn[0] * r(i, 2),
                                                     turn[0] * r(i, 1) - turn[1] * r(i, 0));
}

double kinetic_energy(const ElasticBody& body, NodesRef v) {
    return 0.5 * body.mass_product(v).cwiseProduct(v).sum();
}

}  // namespace nbd
