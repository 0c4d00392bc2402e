#pragma once

#include "collision/bounds/bound.hpp"
#include "collision/bounds/learned/bd_model.hpp"

namespace nbd {

/// BD-Tree: c' = c + Ubar q, r' = r + dr^T |q|, transformed to world space by the pose's alignment
/// [JamesPai04]. Reads only the representatives in a pose.
class BdBound {
 public:
    /// tree, model: must outlive this object.
    BdBound(const SphereTree& tree, const BdModel& model);
    void begin_pose(VerticesRef x) noexcept;
    Sphere bound(int node) const noexcept;

 private:
    const SphereTree* tree_;
    const BdModel* model_;
    ModalCoordinatesScratch scratch_;
    Eigen::VectorXf z_, q_, abs_q_;  // [m]
    RigidTransform align_;
};

}  // namespace nbd
