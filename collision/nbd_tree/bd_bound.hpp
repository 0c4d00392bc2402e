#pragma once

#include <Eigen/Core>
#include <vector>

#include "collision/nbd_tree/modal_coordinates.hpp"
#include "collision/nbd_tree/sphere_tree.hpp"

namespace nbd {

/// Rest-pose data of a BD-Tree over m modes: c' = c + Ubar q, r' = r + dr^T |q| [JamesPai04].
/// Conservative inside the span of U, in the frame aligned to the rest pose.
struct BdModel {
    ClusteredModes modes;
    Eigen::MatrixXf z_to_q;  // [m, m]: (Uhat^T what Uhat)^-1, so that q = z_to_q zhat is the weighted
                             // least-squares fit, exact for a pose in the span of U
    Eigen::MatrixXf Ubar;    // [m, 3 * nodes]: mean of U over the node's vertices; x y z of node 0 first
    Eigen::MatrixXf dr;      // [m, nodes]: largest |U_v - Ubar| over the node's vertices, per mode
};

/// U: modes at the surface's vertices, [3 n, m], vertex-major (x y z of vertex 0 first).
/// Throws std::invalid_argument if U's rows do not fit the tree's vertices, or if the modes are linearly
/// dependent at the representatives.
BdModel build_bd_model(const SphereTree& tree, Eigen::Ref<const Eigen::MatrixXf> U, ClusteredModes modes);

/// Validates a model read from a file. Throws std::invalid_argument, saying what is wrong, unless it fits a
/// tree over a surface of `vertex_count` vertices.
void check_bd_model(const BdModel& model, const SphereTree& tree, int vertex_count);

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
