#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "collision/geometry/box.hpp"
#include "meshing/surface/mesh.hpp"
#include "sim/patches/contact_shape.hpp"

namespace nbd {

/// The surface with which a simulated body makes contact, embedded in its tetrahedra: x = W nodes. A pose
/// costs what is asked of it: positions are computed where they are first read, and kept until the next
/// pose. Reading others writes them, so only one thread at a time may do so.
class ContactSurface {
 public:
    /// X: positions of the tet nodes, [N, 3].
    ContactSurface(std::shared_ptr<const ContactShape> shape, NodesRef X);

    /// Moves the surface to the positions of the tet nodes, [N, 3]. Reads the nodes alone.
    void update(NodesRef nodes);

    const std::shared_ptr<const ContactShape>& shape() const noexcept { return shape_; }
    int vertex_count() const noexcept { return shape_->vertex_count(); }
    const Embedding& W() const noexcept { return shape_->W; }
    const Faces& F() const noexcept { return shape_->F; }
    const SurfaceTopology& topology() const noexcept { return shape_->topology; }
    const ContactPatches& patches() const noexcept { return shape_->patches; }
    /// Whether the leaves of `tree` are the patches.
    bool has_patches_of(const WideTree* tree) const noexcept { return tree && tree == shape_->tree; }
    const Eigen::VectorXd& rest_areas() const noexcept { return shape_->rest_areas; }  // [n] m2
    double rest_diagonal() const noexcept { return shape_->rest_diagonal; }  // of the box at rest, metres

    /// Position of a vertex, metres.
    Eigen::Vector3d x(int vertex) const noexcept {
        const std::size_t v = vertex;
        if (poses_[v] != pose_) compute(vertex);
        return x_.row(vertex);
    }
    /// Computes the positions of these vertices, without repeats, on the threads of the caller's TBB arena.
    void compute(std::span<const int> vertices) const;
    /// Positions of all vertices, [n, 3], on the threads of the caller's TBB arena.
    const Nodes& positions() const;
    /// Outward normal at a point of a face, see the function of this name.
    Eigen::Vector3d feature_normal(int face, const Eigen::Vector3d& barycentric) const noexcept;
    Eigen::Vector3d edge_normal(int edge) const noexcept;

    /// x() of all vertices in single precision, [n, 3]. The first call in a pose computes every position.
    const Vertices& x_float();

    /// A box that holds all vertices: that of the nodes that carry them.
    const Box& box() const noexcept { return box_; }
    struct Ball {
        Eigen::Vector3d centre;
        double radius;
    };
    /// A ball that holds the positions of the vertices of the patch's faces: of the nodes that carry them.
    Ball patch_ball(int patch) const noexcept { return ball_of(shape_->patch_nodes[patch], nodes_); }
    /// A ball that holds the means of vectors that the nodes have, [N, 3], see mean_at(), at all vertices of
    /// a block.
    Ball block_ball(int block, const Nodes& of_nodes) const noexcept {
        return ball_of(shape_->block_nodes[block], of_nodes);
    }
    Ball ball() const noexcept;  // of the positions of the whole surface
    /// Blocks of sixteen patches: of the tree whose leaves the patches are.
    int block_count() const noexcept { return shape_->block_nodes.begin.size() - 1; }
    /// The weighted mean of vectors that the nodes have, [N, 3], at a vertex.
    Eigen::Vector3d mean_at(int vertex, const Nodes& of_nodes) const noexcept;

    /// Number of vertices whose positions were computed in this pose.
    int computed() const noexcept { return computed_; }

 private:
    void compute(int vertex) const noexcept;
    void compute_if_old(int vertex) const noexcept;  // without counting
    void compute_faces_at(int vertex) const noexcept;
    void compute_face(int face) const noexcept;
    Ball ball_of(std::span<const int> nodes, const Nodes& of_nodes) const noexcept;
    Ball ball_around(const Eigen::AlignedBox3d& nodes) const noexcept;

    std::shared_ptr<const ContactShape> shape_;
    Nodes nodes_;
    mutable Nodes x_;
    mutable std::vector<std::uint32_t> poses_;  // [n] pose in which each position was computed
    mutable int computed_ = 0;
    std::uint32_t pose_ = 0;
    Vertices x_float_;
    std::uint32_t float_pose_ = 0;  // pose of x_float_
    Eigen::AlignedBox3d node_box_;
    Box box_;
};

}  // namespace nbd
