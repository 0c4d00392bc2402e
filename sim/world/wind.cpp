#include "sim/world/wind.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>
#include <utility>

namespace nbd {
namespace {

/// Of the rows that carry a vertex of a surface, with its weights.
Eigen::Vector3d carried(const Embedding& W, int vertex, NodesRef rows) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (Embedding::InnerIterator it(W, vertex); it; ++it) sum += it.value() * rows.row(it.col()).transpose();
    return sum;
}

}  // namespace

Wind::Wind(BodyLoad load, const ElasticBody& elastic, const ContactShape& shape)
    : load_(std::move(load)), shape_(&shape) {
    const AirFlow& air = load_.air;
    for (const double number : {air.density, air.normal, air.tangential})
        if (!(number >= 0) || !std::isfinite(number))
            throw std::invalid_argument("load: a wind needs a density and coefficients >= 0");
    const auto is_finite = [](const Eigen::Vector3d& value) { return value.allFinite(); };
    if (!air.velocity.allFinite() || !air.keys.is_sound(is_finite))
        throw std::invalid_argument("load: a wind needs finite velocities at times that increase");
    // Checks the faces, too.
    const LoadForces press({.kind = LoadKind::pressure, .faces = load_.faces}, elastic, shape);
    faces_ = press.load().faces;
    if (!faces_.empty()) return;
    faces_.resize(shape.F.rows());
    std::iota(faces_.begin(), faces_.end(), 0);
}

template <class Visit>
void Wind::for_each_face(NodesRef x, NodesRef v, const Eigen::Vector3d& air, const Visit& visit) const {
    for (const int face : faces_) {
        Eigen::Matrix3d at;
        Eigen::Vector3d velocity = -air;
        for (int k = 0; k < 3; ++k) {
            at.col(k) = carried(shape_->W, shape_->F(face, k), x);
            velocity += carried(shape_->W, shape_->F(face, k), v) / 3;
        }
        const Eigen::Vector3d twice = (at.col(1) - at.col(0)).cross(at.col(2) - at.col(0));
        const double length = twice.norm();
        if (length > 0) visit(face, Eigen::Vector3d(twice / length), length / 2, velocity);
    }
}

Drag Wind::drag(NodesRef x, NodesRef v, const Eigen::Vector3d& air) const {
    const AirFlow& flow = load_.air;
    Drag sum{Nodes::Zero(x.rows(), 3),
             std::vector<Eigen::Matrix3d>(x.rows(), Eigen::Matrix3d(Eigen::Matrix3d::Zero()))};
    for_each_face(x, v, air, [&](int face, const Eigen::Vector3d& n, double area, const Eigen::Vector3d& u) {
        const double half = flow.density * area / 2, met = std::max(n.dot(u), 0.0);
        const Eigen::Vector3d t = u - n.dot(u) * n;
        const double along = t.norm();
        const Eigen::Vector3d force = -half * (flow.normal * met * met * n + flow.tangential * along * t);
        const Eigen::Matrix3d across = n * n.transpose();
        Eigen::Matrix3d slope = 2 * half * flow.normal * met * across;
        if (along > 0)
            slope += half * flow.tangential *
                     (along * (Eigen::Matrix3d::Identity() - across) + t * t.transpose() / along);
        for (const int vertex : shape_->F.row(face))
            for (Embedding::InnerIterator it(shape_->W, vertex); it; ++it) {
                sum.forces.row(it.col()) += it.value() / 3 * force.transpose();
                sum.slopes[it.col()] += std::abs(it.value()) / 3 * slope;
            }
    });
    return sum;
}

double Wind::potential(NodesRef x, NodesRef v, const Eigen::Vector3d& air) const {
    const AirFlow& flow = load_.air;
    double sum = 0;
    for_each_face(x, v, air, [&](int, const Eigen::Vector3d& n, double area, const Eigen::Vector3d& u) {
        const double met = std::max(n.dot(u), 0.0), along = (u - n.dot(u) * n).norm();
        sum += flow.density * area / 6 *
               (flow.normal * met * met * met + flow.tangential * along * along * along);
    });
    return sum;
}

}  // namespace nbd
