#include "sim/patches/contact_surface.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

namespace nbd {
namespace {

ContactPatches make_patches(const WideTree* tree, const SurfaceTopology& topology, const Embedding& W,
                            FacesRef F, NodesRef X) {
    if (tree) return {*tree, topology};
    return {build_wide_tree(embedded(W, X).cast<float>(), F), topology};
}

std::span<const int> nodes_of(const Embedding& W, int vertex) {
    const int *begin = W.outerIndexPtr(), *nodes = W.innerIndexPtr();
    return {nodes + begin[vertex], nodes + begin[vertex + 1]};
}

void sort_out_repeats(std::vector<int>& items, std::ptrdiff_t from) {
    std::sort(items.begin() + from, items.end());
    items.erase(std::unique(items.begin() + from, items.end()), items.end());
}

}  // namespace

ContactSurface::ContactSurface(Embedding W, Faces F, NodesRef X, const WideTree* tree)
    : W_(std::move(W)),
      F_(std::move(F)),
      topology_([&] {
          if (W_.cols() != X.rows() || W_.rows() == 0 || F_.rows() == 0)
              throw std::invalid_argument(fmt::format(
                  "contact surface: an embedding [{}, {}] and {} faces do not fit a body of {} nodes",
                  W_.rows(), W_.cols(), F_.rows(), X.rows()));
          W_.makeCompressed();
          return surface_topology(F_, vertex_count());
      }()),
      tree_(tree),
      patches_(make_patches(tree, topology_, W_, F_, X)),
      poses_(static_cast<std::size_t>(vertex_count()), 0) {
    std::vector<int> vertices;
    for (int patch = 0; patch < patches_.count(); ++patch) {
        const auto from = static_cast<std::ptrdiff_t>(patch_nodes_.items.size());
        vertices.clear();
        for (const int face : patches_.faces[patch])
            for (int k = 0; k < 3; ++k) vertices.push_back(F_(face, k));
        sort_out_repeats(vertices, 0);
        for (const int vertex : vertices) {
            const auto nodes = nodes_of(W_, vertex);
            patch_nodes_.items.insert(patch_nodes_.items.end(), nodes.begin(), nodes.end());
        }
        sort_out_repeats(patch_nodes_.items, from);
        patch_nodes_.end_list();
    }
    std::vector<bool> carries(static_cast<std::size_t>(W_.cols()), false);
    for (const int node : std::span(W_.innerIndexPtr(), static_cast<std::size_t>(W_.nonZeros())))
        carries[static_cast<std::size_t>(node)] = true;
    for (int node = 0; node < W_.cols(); ++node)
        if (carries[static_cast<std::size_t>(node)]) carriers_.push_back(node);
    for (Eigen::Index v = 0; v < W_.rows(); ++v) {
        double negative = 0;
        for (Embedding::InnerIterator entry(W_, v); entry; ++entry) negative -= std::min(entry.value(), 0.0);
        overhang_ = std::max(overhang_, negative);
    }
    x_.resize(W_.rows(), 3);
    const Nodes rest = embedded(W_, X);
    rest_areas_ = vertex_areas(F_, rest);
    rest_diagonal_ = (rest.colwise().maxCoeff() - rest.colwise().minCoeff()).norm();
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
    for (const int node : carriers_) node_box_.extend(nodes_.row(node).transpose());
    // Rounding, of positions and to float, is far below this share of the largest coordinate.
    constexpr double rounding = 1e-6;
    const double room =
        overhang_ * node_box_.sizes().maxCoeff() +
        rounding * std::max(node_box_.min().cwiseAbs().maxCoeff(), node_box_.max().cwiseAbs().maxCoeff());
    const Eigen::Array3f lo = (node_box_.min().array() - room).cast<float>(),
                         hi = (node_box_.max().array() + room).cast<float>();
    box_ = {{lo[0], lo[1], lo[2], 0}, {hi[0], hi[1], hi[2], 0}};
}

void ContactSurface::compute(int vertex) const noexcept {
    x_.row(vertex) = mean_at(vertex, nodes_);
    poses_[static_cast<std::size_t>(vertex)] = pose_;
    ++computed_;
}

void ContactSurface::compute_face(int face) const noexcept {
    for (int k = 0; k < 3; ++k) x(F_(face, k));
}

void ContactSurface::compute_faces_at(int vertex) const noexcept {
    const auto v = static_cast<std::size_t>(vertex);
    for (int i = topology_.vertex_begin[v]; i < topology_.vertex_begin[v + 1]; ++i)
        compute_face(topology_.vertex_faces[static_cast<std::size_t>(i)]);
}

const Vertices& ContactSurface::x_float() {
    if (std::exchange(float_pose_, pose_) == pose_) return x_float_;
    x_float_.resize(vertex_count(), 3);
    for (int v = 0; v < vertex_count(); ++v) x_float_.row(v) = x(v).cast<float>();
    return x_float_;
}

Box ContactSurface::face_box(int face) const noexcept {
    return bounding_box(
        {x(F_(face, 0)).cast<float>(), x(F_(face, 1)).cast<float>(), x(F_(face, 2)).cast<float>()});
}

Eigen::Vector3d ContactSurface::feature_normal(int face, const Eigen::Vector3d& barycentric) const noexcept {
    compute_face(face);
    int corner = 0;
    const auto zeros = (barycentric.array() == 0).count();
    if (zeros == 1) {
        barycentric.minCoeff(&corner);
        return edge_normal(topology_.face_edges(face, corner));
    }
    if (zeros > 1) {
        barycentric.maxCoeff(&corner);
        compute_faces_at(F_(face, corner));
    }
    return nbd::feature_normal(topology_, F_, x_, face, barycentric);
}

Eigen::Vector3d ContactSurface::edge_normal(int edge) const noexcept {
    for (const int face : {topology_.edge_faces(edge, 0), topology_.edge_faces(edge, 1)})
        if (face >= 0) compute_face(face);
    return nbd::edge_normal(topology_, F_, x_, edge);
}

ContactSurface::Ball ContactSurface::ball_around(const Eigen::AlignedBox3d& nodes) const noexcept {
    return {nodes.center(), (1 + 2 * overhang_) * nodes.diagonal().norm() / 2};
}

ContactSurface::Ball ContactSurface::patch_ball(int patch, const Nodes& of_nodes) const noexcept {
    Eigen::AlignedBox3d box;
    for (const int node : patch_nodes_[patch]) box.extend(of_nodes.row(node).transpose());
    return ball_around(box);
}

Eigen::Vector3d ContactSurface::mean_at(int vertex, const Nodes& of_nodes) const noexcept {
    const int begin = W_.outerIndexPtr()[vertex], end = W_.outerIndexPtr()[vertex + 1];
    return embedded_position(end - begin, W_.innerIndexPtr() + begin, W_.valuePtr() + begin, of_nodes.data(),
                             of_nodes.outerStride());
}

ContactSurface::Ball ContactSurface::ball() const noexcept { return ball_around(node_box_); }

}  // namespace nbd
