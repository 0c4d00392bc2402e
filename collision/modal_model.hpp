#pragma once

#include <Eigen/Core>
#include <vector>

#include "collision/modal_code.hpp"
#include "collision/sphere_tree.hpp"

namespace nbd {

/// The paper's NBD-Tree, trained: one code for the body, one small ReLU network a node.
/// A node's network reads zn = (z - z_centre) * z_scale, in [-1, 1] on the training poses, and gives
/// four numbers o; (dc, dr) = o * out_scale + out_centre is added to the rest sphere (equation 6). A linear
/// part of the centre, dc += centre_map^T zn, may be added, which the paper does not have: a node's centre is
/// nearly linear in the code, and the network is left with the rest.
/// Weights lie flat, node after node: W1 [hidden, m], b1, W2 [hidden, hidden], b2, W3 [4, hidden], b3,
/// every matrix column-major.
struct ModalModel {
    static constexpr int outputs = 4;  // dc x y z, dr
    static constexpr int max_hidden = 128;
    ClusteredModes modes;
    int hidden = 32;                        // 1 to max_hidden
    Eigen::VectorXf z_centre, z_scale;      // [m]
    std::vector<float> weights;             // [nodes * weights_per_node()]
    Eigen::MatrixXf out_centre, out_scale;  // [4, nodes]
    Eigen::MatrixXf centre_map;             // [m, 3 * nodes], x y z of node 0 first; empty: none
    /// Where the scaled codes of known poses lie: their mean [m], and a matrix [m, m] that takes the
    /// difference from it to coordinates that are uncorrelated and have variance 1. Both empty: not measured.
    Eigen::VectorXf code_mean;
    Eigen::MatrixXf code_whitening;

    int mode_count() const noexcept { return static_cast<int>(modes.U.cols()); }
    int weights_per_node() const noexcept {
        return hidden * (mode_count() + 1) + hidden * (hidden + 1) + outputs * (hidden + 1);
    }
};

/// Sphere of `node` in the aligned frame. zn: the scaled code, [m]. Never a negative radius.
Sphere modal_sphere(const ModalModel& model, const SphereTree& tree, int node,
                    Eigen::Ref<const Eigen::VectorXf> zn) noexcept;

/// Throws std::invalid_argument with what is wrong unless the model fits a tree over a surface of
/// `vertex_count` vertices: for models that come from a file.
void check_modal_model(const ModalModel& model, const SphereTree& tree, int vertex_count);

}  // namespace nbd
