#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "collision/geometry/embedding.hpp"
#include "collision/geometry/geometry.hpp"

namespace nbd {

/// What a bone does to the rest pose: x = M [X; 1], metres. Any affine map, such as a bone's transform times
/// the inverse of its bind transform.
using BoneTransform = Eigen::Matrix<float, 3, 4>;

/// A surface under linear blend skinning as one that hangs on nodes, so that `affine` bounds hold for it. A
/// vertex follows its bones k with weights w_k: x = sum_k w_k M_k [X; 1]. The surface is divided into
/// patches, and in each patch a bone moves a tetrahedron of four nodes that holds all of its vertices there
/// in the rest pose. A vertex then has the weights w_k l_i with its barycentric coordinates l_i in the
/// tetrahedron of bone k, which are >= 0 and sum to 1. So x = W nodes, in every pose. Small tetrahedra make
/// tight bounds where bones turn against each other.
class Skinning {
 public:
    static constexpr int max_bones = 8;    // of a vertex; 32 nodes, as many as AffineModel takes
    static constexpr int max_patch = 256;  // vertices of a patch

    /// X: rest positions [vertices, 3]. weights: [vertices, bones]. Throws std::invalid_argument, naming the
    /// vertex, if a weight is negative or not finite, a vertex has more than max_bones weights, they do not
    /// sum to 1 within 5e-6, or a position is not finite; and if the weights have not a row for each vertex.
    Skinning(VerticesRef X, const SurfaceEmbedding& weights);

    int bone_count() const noexcept { return bone_count_; }
    /// W, [vertices, nodes], and the nodes' rest positions: what hang_on_nodes() takes.
    const SurfaceEmbedding& embedding() const noexcept { return W_; }
    const Vertices& rest_nodes() const noexcept { return rest_nodes_; }

    /// Writes the nodes of a pose, like rest_nodes(), for PosedTree::begin_pose_of_nodes(). bones: one
    /// transform per bone, else std::invalid_argument. nodes: allocated only when its size differs.
    void pose(std::span<const BoneTransform> bones, Vertices& nodes) const;

 private:
    int bone_count_;
    SurfaceEmbedding W_;
    Vertices rest_nodes_;     // four in a row for each tetrahedron
    std::vector<int> bones_;  // of the tetrahedra
};

}  // namespace nbd
