#pragma once

#include <Eigen/Core>
#include <array>
#include <span>
#include <vector>

#include "collision/nbd_tree/modal_coordinates.hpp"
#include "collision/nbd_tree/nbd_networks.hpp"
#include "collision/nbd_tree/sphere_tree.hpp"

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

/// The paper's NBD-Tree: modal coordinates once per pose, one small network per node. Reads only the
/// representatives in a pose.
class NbdBound {
 public:
    /// tree, model: must outlive this object.
    NbdBound(const SphereTree& tree, const NbdModel& model);
    void begin_pose(VerticesRef x) noexcept;
    /// Bounds both children of a node when either is asked for, since a query asks for the other next.
    Sphere bound(int node) noexcept {
        const int first = node == 0 ? 0 : (node - 1) / 2 * 2 + 1;  // children come in pairs after the root
        if (first != first_) {
            first_ = first;
            nbd_spheres(*model_, *tree_, first, zn_, std::span(spheres_).first(first == 0 ? 1 : 2));
        }
        last_ = to_world(align_, spheres_[node - first]);
        return last_;
    }
    /// The sum of two terms: the distance of the pose's modal coordinates from known ones, in standard
    /// deviations (root mean square over uncorrelated directions; 0 if the model does not hold their
    /// distribution), and how far the node's representatives stand outside its sphere, 5 % of the radius
    /// counting as one standard deviation. The first detects unfamiliar poses, the second nodes that the
    /// networks get wrong.
    float ood_score(int node) noexcept;

    /// The pose's scaled modal coordinates, [m], valid until the next pose.
    Eigen::Map<const Eigen::VectorXf> scaled_coordinates() const noexcept { return zn_.numbers(); }

    /// How far the node's representatives stand outside the sphere that bound() gave last, in its radii, 0 or
    /// more; NaN where the sphere is not finite.
    float outside(int node) const noexcept;

 private:
    const SphereTree* tree_;
    const NbdModel* model_;
    std::vector<int> seen_;        // rows of the representatives among the tree's vertices, in their order
    std::vector<int> seen_begin_;  // [vertices of the tree + 1] start in `seen_` for each vertex
    ModalCoordinatesScratch scratch_;
    Eigen::VectorXf z_;                      // [m] modal coordinates
    FixedVector zn_;                         // [m] scaled modal coordinates
    Eigen::VectorXf difference_, whitened_;  // [m] scratch
    float pose_ood_score_ = -1;              // first term of ood_score(); negative: not computed yet
    RigidTransform align_;
    int first_ = -1;                 // first node of `spheres_`; negative: none
    std::array<Sphere, 2> spheres_;  // in the aligned frame
    Sphere last_;                    // last result of bound()
};

}  // namespace nbd
