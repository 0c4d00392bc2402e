#pragma once

#include <Eigen/Core>
#include <span>

#include "collision/bounds/learned/modal_coordinates.hpp"
#include "collision/bounds/learned/nbd_networks.hpp"
#include "collision/topology/sphere_tree.hpp"

namespace nbd {

/// The trained model of the paper's NBD-Tree: modal coordinates z of the body, one small ReLU network per
/// node. A node's network reads zn = (z - z_centre) * z_scale, in [-1, 1] on the training poses, and gives
/// four numbers o; (dc, dr) = o * out_scale + out_centre is added to the rest sphere (equation 6). Beyond the
/// paper, a linear part of the centre, dc += centre_map^T zn, may be added: a node's centre is nearly linear
/// in z, and the network learns only the remainder.
struct NbdModel {
    static constexpr int outputs = NbdNetworks::outputs;  // dc x y z, dr
    ClusteredModes modes;
    Eigen::VectorXf z_centre, z_scale;      // [m]
    NbdNetworks networks;                   // one per node
    Eigen::MatrixXf out_centre, out_scale;  // [4, nodes]
    FixedMatrix centre_map;                 // [m, 3 * nodes], x y z of node 0 first; empty: no linear part
    /// Distribution of zn over known poses: its mean [m], and a matrix [m, m] that maps differences from the
    /// mean to uncorrelated coordinates of variance 1. Both empty: not measured.
    Eigen::VectorXf z_mean;
    Eigen::MatrixXf z_whitening;

    int mode_count() const noexcept { return modes.U.cols(); }
};

/// Computes the spheres of nodes first to first + spheres.size() - 1, at most NbdNetworks::max_at_once, in
/// the aligned frame. zn: scaled modal coordinates [m], after fix(). Radii are never negative.
void nbd_spheres(const NbdModel& model, const SphereTree& tree, int first, const FixedVector& zn,
                 std::span<Sphere> spheres) noexcept;

/// Returns the distance of scaled modal coordinates zn, [m], from those of known poses, in standard
/// deviations: the root mean square over uncorrelated directions; 0 if `mean` is empty. mean, whitening: see
/// NbdModel. difference, whitened: scratch, [m].
float coordinate_ood_score(const Eigen::VectorXf& mean, const Eigen::MatrixXf& whitening,
                           Eigen::Ref<const Eigen::VectorXf> zn, Eigen::VectorXf& difference,
                           Eigen::VectorXf& whitened) noexcept;

/// Returns the out-of-distribution score of a node from that of the modal coordinates and the distance of its
/// representatives outside of its sphere, in radii; see NbdBound.
inline float nbd_ood_score(float coordinates, float outside) noexcept {
    constexpr float radii = 20;  // one radius outside counts as this many standard deviations
    return coordinates + radii * outside;
}

/// Validates a model read from a file. Throws std::invalid_argument, saying what is wrong, unless it fits a
/// tree over a surface of `vertex_count` vertices.
void check_nbd_model(const NbdModel& model, const SphereTree& tree, int vertex_count);

}  // namespace nbd
