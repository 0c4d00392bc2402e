#pragma once

#include <Eigen/Core>
#include <vector>

#include "collision/bounds/learned/fixed_point.hpp"
#include "collision/geometry/geometry.hpp"

namespace nbd {

/// x = R y + t: takes aligned positions to the world.
struct RigidTransform {
    Eigen::Matrix3f R = Eigen::Matrix3f::Identity();
    Eigen::Vector3f t = Eigen::Vector3f::Zero();
};

inline Sphere to_world(const RigidTransform& align, const Sphere& s) noexcept {
    return {align.R * s.c + align.t, s.r};
}

/// The rigid motion that takes rest positions X to x best in the weighted least-squares sense, by shape
/// matching [Mueller05]. R is a proper rotation also for flat, straight or reflected sets; where the points
/// leave it open, the one nearest to the identity. X, x: [k, 3], k >= 1; w: [k], > 0.
RigidTransform match_shape(VerticesRef X, VerticesRef x, Eigen::Ref<const Eigen::VectorXf> w) noexcept;

/// What turns a pose into the paper's code zhat = Uhat^T what * (yhat - Xhat): the k representative
/// vertices, their cluster sizes, and their rows of U. (Equations 2 and 4.)
struct ClusteredModes {
    std::vector<int> representatives;  // [k] rows of the surface's vertices
    Eigen::VectorXf w;                 // [k] cluster sizes
    Vertices X;                        // [k, 3] rest positions of the representatives
    FixedMatrix U;                     // [3 k, m] rows of U, vertex-major
};

/// Throws std::invalid_argument with what is wrong unless the arrays fit each other and a surface of
/// `vertex_count` vertices: for modes that come from a file.
void check_clustered_modes(const ClusteredModes& modes, int vertex_count);

/// Scratch of `modal_coordinates`, so that a query allocates nothing.
struct ModalCoordinatesScratch {
    Vertices x;     // [k, 3]
    FixedVector d;  // [3 k]
};

/// Aligns the representatives of pose `x` and projects them on the modes.
/// x: all positions [n, 3]. z: out, [m]. Returns the transform from the aligned frame to the world.
RigidTransform modal_coordinates(const ClusteredModes& modes, VerticesRef x, ModalCoordinatesScratch& scratch,
                                 Eigen::Ref<Eigen::VectorXf> z) noexcept;

}  // namespace nbd
