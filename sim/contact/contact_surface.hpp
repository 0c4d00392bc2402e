#pragma once

#include <vector>

#include "collision/geometry/box.hpp"
#include "meshing/surface/mesh.hpp"
#include "sim/contact/surface_normals.hpp"

namespace nbd {

/// The surface with which a simulated body makes contact, embedded in its tetrahedra: x = W nodes.
class ContactSurface {
 public:
    /// W: [n, N], rows sum to 1; F: faces over the n surface vertices; X: rest positions of the tet nodes,
    /// [N, 3]. Throws std::invalid_argument where shapes or indices disagree.
    ContactSurface(Embedding W, Faces F, NodesRef X);

    /// Moves the surface to the positions of the tet nodes, [N, 3].
    void update(NodesRef nodes);

    int vertex_count() const noexcept { return static_cast<int>(W_.rows()); }
    const Embedding& W() const noexcept { return W_; }
    const Faces& F() const noexcept { return F_; }
    const SurfaceTopology& topology() const noexcept { return topology_; }
    const Eigen::VectorXd& rest_areas() const noexcept { return rest_areas_; }  // [n] m2
    double rest_diagonal() const noexcept { return rest_diagonal_; }            // of the box at rest, metres
    const Nodes& x() const noexcept { return x_; }                              // [n, 3] of the last update
    const Vertices& x_float() const noexcept { return x_float_; }               // x() in single precision
    const Box& face_box(int face) const noexcept { return face_boxes_[static_cast<std::size_t>(face)]; }
    const Box& box() const noexcept { return box_; }  // of all faces

 private:
    Embedding W_;
    Faces F_;
    SurfaceTopology topology_;
    Eigen::VectorXd rest_areas_;
    double rest_diagonal_ = 0;
    Nodes x_;
    Vertices x_float_;
    std::vector<Box> face_boxes_;  // [m], of x_float()
    Box box_;
};

}  // namespace nbd
