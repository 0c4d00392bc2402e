#pragma once

#include <array>
#include <vector>

#include "collision/bounds/bound.hpp"
#include "collision/bounds/learned/nbd_model.hpp"

namespace nbd {

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
