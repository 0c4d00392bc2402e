#pragma once

#include "collision/bound.hpp"
#include "collision/modal_model.hpp"

namespace nbd {

/// The paper's NBD-Tree: one code a pose, one small network a node. Reads the representatives of a pose
/// alone.
class ModalBound {
 public:
    /// tree and model: referred to.
    ModalBound(const SphereTree& tree, const ModalModel& model);
    void begin_pose(VerticesRef x) noexcept;
    Sphere bound(int node) const noexcept {
        return to_world(align_, modal_sphere(*model_, *tree_, node, zn_));
    }
    /// How much of the representatives' motion the modes do not see, in body sizes: the same for all nodes,
    /// computed when first asked for in a pose.
    float strangeness(int node) noexcept;

 private:
    const SphereTree* tree_;
    const ModalModel* model_;
    ModalCodeScratch scratch_;
    Eigen::VectorXf z_, zn_;     // [m] the code, and scaled
    Eigen::VectorXf explained_;  // [3 k] scratch
    float unexplained_ = -1;     // of this pose; negative: not computed yet
    RigidTransform align_;
};

}  // namespace nbd
