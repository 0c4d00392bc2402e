#pragma once

#include <Eigen/Core>
#include <span>

#include "collision/bounds/learned/byte_networks.hpp"
#include "collision/bounds/learned/modal_coordinates.hpp"
#include "collision/topology/sphere_tree.hpp"

namespace nbd {

/// The paper's NBD-Tree, trained: one code for the body, one small ReLU network a node.
/// A node's network reads zn = (z - z_centre) * z_scale, in [-1, 1] on the training poses, and gives
/// four numbers o; (dc, dr) = o * out_scale + out_centre is added to the rest sphere (equation 6). A linear
/// part of the centre, dc += centre_map^T zn, may be added, which the paper does not have: a node's centre is
/// nearly linear in the code, and the network is left with the rest.
struct NbdModel {
    static constexpr int outputs = ByteNetworks::outputs;  // dc x y z, dr
    ClusteredModes modes;
    Eigen::VectorXf z_centre, z_scale;      // [m]
    ByteNetworks networks;                  // of all nodes
    Eigen::MatrixXf out_centre, out_scale;  // [4, nodes]
    FixedMatrix centre_map;                 // [m, 3 * nodes], x y z of node 0 first; empty: none
    /// Where the scaled codes of known poses lie: their mean [m], and a matrix [m, m] that takes the
    /// difference from it to coordinates that are uncorrelated and have variance 1. Both empty: not measured.
    Eigen::VectorXf z_mean;
    Eigen::MatrixXf z_whitening;

    int mode_count() const noexcept { return static_cast<int>(modes.U.cols()); }
};

/// Spheres in the aligned frame of nodes first to first + spheres.size() - 1, at most
/// ByteNetworks::max_at_once. zn: the scaled code, [m], fixed. Never a negative radius.
void nbd_spheres(const NbdModel& model, const SphereTree& tree, int first, const FixedVector& zn,
                 std::span<Sphere> spheres) noexcept;

/// Distance of scaled modal coordinates zn, [m], from those of known poses, in standard deviations: the root
/// mean square over uncorrelated directions; 0 where `mean` is empty. mean, whitening: see NbdModel.
/// difference, whitened: scratch, [m].
float coordinate_ood_score(const Eigen::VectorXf& mean, const Eigen::MatrixXf& whitening,
                           Eigen::Ref<const Eigen::VectorXf> zn, Eigen::VectorXf& difference,
                           Eigen::VectorXf& whitened) noexcept;

/// Out-of-distribution score of a node: that of the modal coordinates, and `outside` radii, see NbdBound.
inline float nbd_ood_score(float coordinates, float outside) noexcept {
    constexpr float radii = 20;  // standard deviations that a radius counts as
    return coordinates + radii * outside;
}

/// Throws std::invalid_argument with what is wrong unless the model fits a tree over a surface of
/// `vertex_count` vertices: for models that come from a file.
void check_nbd_model(const NbdModel& model, const SphereTree& tree, int vertex_count);

}  // namespace nbd
