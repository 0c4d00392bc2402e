#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

namespace nbd {

/// Calls visit(x, y, weights) for every grid cell whose centre lies in the triangle. weights: barycentric. p:
/// corners, in cells.
template <class Visit>
void for_each_cell(const std::array<Eigen::Vector2f, 3>& p, int width, int height, const Visit& visit) {
    const Eigen::Vector2f ab = p[1] - p[0], ac = p[2] - p[0];
    const float area = ab.x() * ac.y() - ab.y() * ac.x();
    if (!(std::abs(area) > 1e-12f)) return;
    const auto bound = [](float v, int limit) {
        return static_cast<int>(std::clamp(v, 0.f, static_cast<float>(limit - 1)));
    };
    const auto [left, right] = std::minmax({p[0].x(), p[1].x(), p[2].x()});
    const auto [top, bottom] = std::minmax({p[0].y(), p[1].y(), p[2].y()});
    if (right < 0 || bottom < 0 || left > static_cast<float>(width) || top > static_cast<float>(height))
        return;
    for (int y = bound(top, height); y <= bound(bottom, height); ++y)
        for (int x = bound(left, width); x <= bound(right, width); ++x) {
            const Eigen::Vector2f d =
                Eigen::Vector2f(static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f) - p[0];
            const float u = (d.x() * ac.y() - d.y() * ac.x()) / area,
                        v = (ab.x() * d.y() - ab.y() * d.x()) / area;
            if (u >= 0 && v >= 0 && u + v <= 1) visit(x, y, Eigen::Vector3f(1 - u - v, u, v));
        }
}

/// Shadow map of a light: the nearest depth in every cell of a square. Points behind it are in shadow.
class DepthMap {
 public:
    /// The light shines along `direction` (unit) on a ball.
    DepthMap(const Eigen::Vector3f& direction, const Eigen::Vector3f& centre, float radius)
        : forward_(direction),
          right_(direction.unitOrthogonal()),
          up_(right_.cross(direction)),
          centre_(centre),
          cells_per_metre_(static_cast<float>(cells) / (2 * radius)),
          depth_(static_cast<std::size_t>(cells) * cells, std::numeric_limits<float>::infinity()) {}

    void add(const std::array<Eigen::Vector3f, 3>& triangle) {
        std::array<Eigen::Vector3f, 3> p;
        for (std::size_t c = 0; c < 3; ++c) p[c] = seen(triangle[c]);
        for_each_cell({Eigen::Vector2f(p[0].head<2>()), p[1].head<2>(), p[2].head<2>()}, cells, cells,
                      [&](int x, int y, const Eigen::Vector3f& w) {
                          float& nearest = at(x, y);
                          nearest = std::min(nearest, w[0] * p[0].z() + w[1] * p[1].z() + w[2] * p[2].z());
                      });
    }

    /// Share of the light that reaches a point, softened over a few cells.
    float light_at(const Eigen::Vector3f& p) const {
        const Eigen::Vector3f q = seen(p);
        const float bias = 2.5f / cells_per_metre_;
        int lit = 0, count = 0;
        for (int dy = -3; dy <= 3; ++dy)
            for (int dx = -3; dx <= 3; ++dx) {
                const int x = static_cast<int>(std::floor(q.x())) + dx,
                          y = static_cast<int>(std::floor(q.y())) + dy;
                ++count;
                lit +=
                    x < 0 || y < 0 || x >= cells || y >= cells ||
                    q.z() < depth_[static_cast<std::size_t>(y) * cells + static_cast<std::size_t>(x)] + bias;
            }
        return static_cast<float>(lit) / static_cast<float>(count);
    }

 private:
    static constexpr int cells = 1200;  // per side

    float& at(int x, int y) {
        return depth_[static_cast<std::size_t>(y) * cells + static_cast<std::size_t>(x)];
    }
    /// A point as the light sees it: x, y in cells, depth in metres.
    Eigen::Vector3f seen(const Eigen::Vector3f& p) const {
        const Eigen::Vector3f d = p - centre_;
        constexpr float middle = cells / 2.f;
        return {middle + cells_per_metre_ * d.dot(right_), middle + cells_per_metre_ * d.dot(up_),
                d.dot(forward_)};
    }

    Eigen::Vector3f forward_, right_, up_, centre_;
    float cells_per_metre_;
    std::vector<float> depth_;
};

}  // namespace nbd
