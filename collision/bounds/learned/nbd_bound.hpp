#pragma once

#include <array>
#include <vector>

#include "collision/bounds/bound.hpp"
#include "collision/bounds/learned/nbd_model.hpp"

namespace nbd {

/// The paper's NBD-Tree: one code a pose, one small network a node. Reads the representatives of a pose
/// alone.
class NbdBound {
 public:
    /// tree and model: referred to.
    NbdBound(const SphereTree& tree, const NbdModel& model);
    void begin_pose(VerticesRef x) noexcept;
    /// Both children of a node are bounded when the first of them is asked for, since who asks for one asks
    /// for the other next.
    Sphere bound(int node) noexcept {
        const int first = node == 0 ? 0 : (node - 1) / 2 * 2 + 1;  // children come in pairs after the root
        if (first != first_) {
            first_ = first;
            nbd_spheres(*model_, *tree_, first, zn_, std::span(spheres_).first(first == 0 ? 1 : 2));
        }
        last_ = to_world(align_, spheres_[static_cast<std::size_t>(node - first)]);
        return last_;
    }
    /// How far the pose's code lies from those that are known, in standard deviations (the root mean square
    /// over uncorrelated directions; 0 where the model does not say), and how far the node's representatives
    /// stand outside its sphere, 5 % of the radius weighing as much as one standard deviation. The first sees
    /// poses that the networks never saw, the second nodes that they get wrong.
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
    std::vector<int> seen_begin_;  // [vertices of the tree + 1] where those from a vertex on begin
    ModalCoordinatesScratch scratch_;
    Eigen::VectorXf z_;                      // [m] the code
    FixedVector zn_;                         // scaled
    Eigen::VectorXf difference_, whitened_;  // [m] scratch
    float code_ood_score_ = -1;              // of this pose; negative: not computed yet
    RigidTransform align_;
    int first_ = -1;                 // of the nodes that spheres_ belong to; negative: none
    std::array<Sphere, 2> spheres_;  // in the aligned frame
    Sphere last_;                    // that bound() gave
};

}  // namespace nbd
