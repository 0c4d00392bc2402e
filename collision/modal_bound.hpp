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

 private:
    const SphereTree* tree_;
    const ModalModel* model_;
    ModalCodeScratch scratch_;
    Eigen::VectorXf zn_;  // [m] the code, scaled
    RigidTransform align_;
};

}  // namespace nbd
