#pragma once

#include <Eigen/Core>

#include "collision/geometry/geometry.hpp"

namespace nbd {

/// x = R y + t maps aligned positions to world space.
struct RigidTransform {
    Eigen::Matrix3f R = Eigen::Matrix3f::Identity();
    Eigen::Vector3f t = Eigen::Vector3f::Zero();
};

inline Sphere to_world(const RigidTransform& align, const Sphere& s) noexcept {
    return {align.R * s.c + align.t, s.r};
}

/// The rigid motion that best maps rest positions X to x in the weighted least-squares sense, by shape
/// matching [Mueller05]. R is a proper rotation even for flat, straight or reflected sets; if the points do
/// not determine it, it is the one nearest to the identity. X, x: [k, 3], k >= 1; w: [k], > 0.
RigidTransform match_shape(VerticesRef X, VerticesRef x, Eigen::Ref<const Eigen::VectorXf> w) noexcept;

}  // namespace nbd
