#pragma once

#include <Eigen/Core>
#include <vector>

#include "collision/nbd_tree/fixed_point.hpp"
#include "collision/nbd_tree/shape_matching.hpp"

namespace nbd {

/// Maps a pose to the paper's modal coordinates zhat = Uhat^T what * (yhat - Xhat), its equations 2 and 4:
/// the k representative vertices, their cluster sizes and their rows of U.
struct ClusteredModes {
    std::vector<int> representatives;  // [k] vertices of the surface
    Eigen::VectorXf w;                 // [k] cluster sizes
    Vertices X;                        // [k, 3] rest positions of the representatives
    FixedMatrix U;                     // [3 k, m] rows of U, vertex-major
};

/// Validates modes read from a file. Throws std::invalid_argument, saying what is wrong, unless the arrays
/// fit each other and a surface of `vertex_count` vertices.
void check_clustered_modes(const ClusteredModes& modes, int vertex_count);

/// Scratch memory of modal_coordinates(), so that a query allocates nothing.
struct ModalCoordinatesScratch {
    Vertices x;     // [k, 3]
    FixedVector d;  // [3 k]

    /// Makes room for k representatives; modal_coordinates() does it if nobody did.
    void fit(Eigen::Index k) {
        x.resize(k, 3);
        if (d.size() != 3 * k) d = FixedVector(3 * k);
    }
};

/// Aligns the representatives of pose `x` with the rest pose and projects them on the modes.
/// x: all positions [n, 3]. z: output, [m]. Returns the transform from the aligned frame to the world.
RigidTransform modal_coordinates(const ClusteredModes& modes, VerticesRef x, ModalCoordinatesScratch& scratch,
                                 Eigen::Ref<Eigen::VectorXf> z) noexcept;

}  // namespace nbd
