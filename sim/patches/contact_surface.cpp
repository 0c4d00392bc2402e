#include "sim/patches/contact_surface.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "meshing/parallel/parallel_for.hpp"

namespace nbd {
ContactSurface::ContactSurface(std::shared_ptr<const ContactShape> shape, NodesRef X)
    : shape_(std::move(shape)), x_(shape_->W.rows(), 3), poses_(vertex_count(), 0) {
    update(X);
}

void ContactSurface::update(NodesRef nodes) {
    nodes_ = nodes;
    if (++pose_ == 0) {  // the counter wrapped around
        std::ranges::fill(poses_, 0);
        float_pose_ = 0;
        pose_ = 1;
    }
    computed_ = 0;
    node_box_.setEmpty();
    for (const int node : shape_->carriers) node_box_.extend(nodes_.row(node).transpose());
    // Rounding, of positions and to float, is far below this share of the largest coordinate.
    constexpr double rounding = 1e-6;
    const double room =
        shape_->overhang * node_box_.sizes().maxCoeff() +
        rounding * std::max(node_box_.min().cwiseAbs().maxCoeff(), node_box_.max().cwiseAbs().maxCoeff());
    const Eigen::Array3f lo = (node_box_.min().array() - room).cast<float>(),
                         hi = (node_box_.max().array() + room).cast<float>();
    box_ = {{lo[0], lo[1], lo[2], 0}, {hi[0], hi[1], hi[2], 0}};
}

void ContactSurface::compute(int vertex) const noexcept {
    x_.row(vertex) = mean_at(vertex, nodes_);
    poses_[vertex] = pose_;
    ++computed_;
}

void ContactSurface::compute_if_old(int vertex) const noexcept {
    if (std::exchange(poses_[vertex], pose_) != pose_) x_.row(vertex) = mean_at(vertex, nodes_);
}

void ContactSurface::compute(std::span<const int> vertices) const {
    for (const int vertex : vertices) computed_ += poses_[vertex] != pose_;
    parallel_for(vertices.size(), [&](int i) { compute_if_old(vertices[i]); });
}

const Nodes& ContactSurface::positions() const {
    parallel_for(vertex_count(), [&](int vertex) { compute_if_old(vertex); });
    computed_ = vertex_count();
    return x_;
}

void ContactSurface::compute_face(int face) const noexcept {
    for (int k = 0; k < 3; ++k) x(shape_->F(face, k));
}

void ContactSurface::compute_faces_at(int vertex) const noexcept {
    const std::size_t v = vertex;
    for (int i = shape_->topology.vertex_begin[v]; i < shape_->topology.vertex_begin[v + 1]; ++i)
        compute_face(shape_->topology.vertex_faces[i]);
}

const Vertices& ContactSurface::x_float() {
    if (std::exchange(float_pose_, pose_) == pose_) return x_float_;
    x_float_.resize(vertex_count(), 3);
    for (int v = 0; v < vertex_count(); ++v) x_float_.row(v) = x(v).cast<float>();
    return x_float_;
}

Eigen::Vector3d ContactSurface::feature_normal(int face, const Eigen::Vector3d& barycentric) const noexcept {
    compute_face(face);
    int corner = 0;
    const auto zeros = (barycentric.array() == 0).count();
    if (zeros == 1) {
        barycentric.minCoeff(&corner);
        return edge_normal(shape_->topology.face_edges(face, corner));
    }
    if (zeros > 1) {
        barycentric.maxCoeff(&corner);
        compute_faces_at(shape_->F(face, corner));
    }
    return nbd::feature_normal(shape_->topology, shape_->F, x_, face, barycentric);
}

Eigen::Vector3d ContactSurface::edge_normal(int edge) const noexcept {
    for (const int face : {shape_->topology.edge_faces(edge, 0), shape_->topology.edge_faces(edge, 1)})
        if (face >= 0) compute_face(face);
    return nbd::edge_normal(shape_->topology, shape_->F, x_, edge);
}

ContactSurface::Ball ContactSurface::ball_around(const Eigen::AlignedBox3d& nodes) const noexcept {
    return {nodes.center(), (1 + 2 * shape_->overhang) * nodes.diagonal().norm() / 2};
}

ContactSurface::Ball ContactSurface::ball_of(std::span<const int> nodes,
                                             const Nodes& of_nodes) const noexcept {
    Eigen::AlignedBox3d box;
    for (const int node : nodes) box.extend(of_nodes.row(node).transpose());
    return ball_around(box);
}

Eigen::Vector3d ContactSurface::mean_at(int vertex, const Nodes& of_nodes) const noexcept {
    const int begin = shape_->W.outerIndexPtr()[vertex], end = shape_->W.outerIndexPtr()[vertex + 1];
    return embedded_position(end - begin, shape_->W.innerIndexPtr() + begin, shape_->W.valuePtr() + begin,
                             of_nodes.data(), of_nodes.outerStride());
}

ContactSurface::Ball ContactSurface::ball() const noexcept { return ball_around(node_box_); }

}  // namespace nbd
