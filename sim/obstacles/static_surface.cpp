#include "sim/obstacles/static_surface.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <utility>

#include "collision/geometry/closest_points.hpp"

namespace nbd {

StaticSurface::StaticSurface(TriMesh mesh) : mesh_(std::move(mesh)) {
    if (mesh_.F.rows() == 0) throw std::invalid_argument("static surface: it has no faces");
    if (!mesh_.X.allFinite()) throw std::invalid_argument("static surface: a vertex is not finite");
    topology_ = surface_topology(mesh_.F, mesh_.X.rows());
    for (Eigen::Index e = 0; e < topology_.edges.rows(); ++e)
        if (topology_.edge_faces(e, 1) < 0)
            throw std::invalid_argument(fmt::format("static surface: it is open at edge {}-{}",
                                                    topology_.edges(e, 0), topology_.edges(e, 1)));
    order_.resize(mesh_.F.rows());
    std::iota(order_.begin(), order_.end(), 0);
    build(0, order_.size());
}

int StaticSurface::build(int begin, int end) {
    constexpr int leaf_faces = 4;
    const int index = nodes_.size();
    BoxNode node{.box = {}, .begin = begin, .end = end};
    Eigen::AlignedBox3d centres;
    const auto centre = [&](int f) -> Eigen::Vector3d {
        return (mesh_.X.row(mesh_.F(f, 0)) + mesh_.X.row(mesh_.F(f, 1)) + mesh_.X.row(mesh_.F(f, 2))) / 3;
    };
    for (int i = begin; i < end; ++i) {
        const int f = order_[i];
        for (int k = 0; k < 3; ++k) node.box.extend(mesh_.X.row(mesh_.F(f, k)).transpose());
        centres.extend(centre(f));
    }
    nodes_.push_back(node);
    if (end - begin <= leaf_faces) return index;
    int axis = 0;
    centres.sizes().maxCoeff(&axis);
    const int middle = (begin + end) / 2;
    std::nth_element(
        order_.begin() + begin, order_.begin() + middle, order_.begin() + end,
        [&](int a, int b) { return std::pair(centre(a)[axis], a) < std::pair(centre(b)[axis], b); });
    build(begin, middle);
    const int right = build(middle, end);
    nodes_[index].right = right;
    return index;
}

std::optional<SurfaceDistance> StaticSurface::distance(const Eigen::Vector3d& p,
                                                       double reach) const noexcept {
    if (nodes_.front().box.exteriorDistance(p) > reach) return std::nullopt;
    double best = std::numeric_limits<double>::infinity();  // squared
    int best_face = -1;
    ClosestPoints nearest{};
    std::array<int, 64> stack;  // enough: the tree is balanced, with a height below 32
    std::size_t top = 0;
    stack[top++] = 0;
    while (top > 0) {
        const int index = stack[--top];
        const BoxNode& node = nodes_[index];
        if (node.box.squaredExteriorDistance(p) >= best) continue;
        if (node.right >= 0) {
            int near = index + 1, far = node.right;
            if (nodes_[far].box.squaredExteriorDistance(p) < nodes_[near].box.squaredExteriorDistance(p))
                std::swap(near, far);
            stack[top++] = far;
            stack[top++] = near;
            continue;
        }
        for (int i = node.begin; i < node.end; ++i) {
            const int f = order_[i];
            const Eigen::Vector3d a = mesh_.X.row(mesh_.F(f, 0)), b = mesh_.X.row(mesh_.F(f, 1)),
                                  c = mesh_.X.row(mesh_.F(f, 2));
            const ClosestPoints closest = closest_point_triangle(p, a, b, c);
            if (closest.gap.squaredNorm() < best) {
                best = closest.gap.squaredNorm();
                best_face = f;
                nearest = closest;
            }
        }
    }
    const Eigen::Vector3d outward = feature_normal(topology_, mesh_.F, mesh_.X, best_face, nearest.weights_b);
    const double distance = std::sqrt(best), sign = nearest.gap.dot(outward) < 0 ? -1 : 1;
    if (distance < 1e-12) return SurfaceDistance{.distance = 0, .normal = outward};
    return SurfaceDistance{.distance = sign * distance, .normal = sign * nearest.gap / distance};
}

}  // namespace nbd
