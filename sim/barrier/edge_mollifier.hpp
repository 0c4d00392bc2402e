#pragma once

#include <Eigen/Core>

namespace nbd {

/// The weight of the potential between two edges, and its derivatives. The closest points of two edges jump
/// where these become parallel, so there the distance has a kink. The weight
///
///   m = q (2 - q) for q < 1, otherwise 1,   q = |u x w|^2 / (10^-3 |U|^2 |W|^2)
///
/// and its gradient vanish there, and the potential times m is once continuously differentiable. What keeps
/// parallel edges apart is the potential between their ends and the faces beside them. Source: [Li20],
/// section 5.
struct EdgeMollifier {
    double value = 1;
    Eigen::Vector3d by_u = Eigen::Vector3d::Zero(), by_w = by_u;  // gradient, 1/m
    double curvature_u = 0, curvature_w = 0;  // second derivatives along it, or 0 if negative, 1/m2
};

/// u, w: the edges, each as the difference of its ends, metres. rest_u, rest_w: their squared lengths at
/// rest.
EdgeMollifier edge_mollifier(const Eigen::Vector3d& u, const Eigen::Vector3d& w, double rest_u,
                             double rest_w) noexcept;

}  // namespace nbd
