#include "sim/obstacles/obstacle.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace nbd {
namespace {

using Distance = std::optional<SurfaceDistance>;

Distance distance_to(const PlaneShape& plane, const Eigen::Vector3d& p, double) noexcept {
    return SurfaceDistance{.distance = plane.normal.dot(p - plane.point), .normal = plane.normal};
}

Distance distance_to(const BallShape& ball, const Eigen::Vector3d& p, double) noexcept {
    const Eigen::Vector3d d = p - ball.centre;
    const double length = d.norm();
    if (length == 0) return SurfaceDistance{.distance = -ball.radius, .normal = Eigen::Vector3d::UnitZ()};
    return SurfaceDistance{.distance = length - ball.radius, .normal = d / length};
}

Distance distance_to(const std::shared_ptr<const StaticSurface>& mesh, const Eigen::Vector3d& p,
                     double reach) noexcept {
    return mesh->distance(p, reach);
}

void check_shape(const PlaneShape& plane) {
    if (!plane.point.allFinite() || !(std::abs(plane.normal.norm() - 1) < 1e-6))
        throw std::invalid_argument("obstacle: a plane needs a finite point and a unit normal");
}

void check_shape(const BallShape& ball) {
    if (!ball.centre.allFinite() || !(ball.radius > 0) || !std::isfinite(ball.radius))
        throw std::invalid_argument(
            fmt::format("obstacle: a sphere needs a finite centre and a radius > 0, not {}", ball.radius));
}

void check_shape(const std::shared_ptr<const StaticSurface>& mesh) {
    if (!mesh) throw std::invalid_argument("obstacle: the mesh is missing");
}

}  // namespace

void check_obstacle(const Obstacle& obstacle) {
    std::visit([](const auto& shape) { check_shape(shape); }, obstacle.shape);
    if (!obstacle.velocity.allFinite()) throw std::invalid_argument("obstacle: its velocity is not finite");
    if (!(obstacle.friction >= 0) || !std::isfinite(obstacle.friction))
        throw std::invalid_argument(
            fmt::format("obstacle: friction is {}, but must be >= 0", obstacle.friction));
    if (!std::isfinite(obstacle.start) || !(obstacle.stop >= obstacle.start))
        throw std::invalid_argument(
            fmt::format("obstacle: it starts at {} s and stops at {} s, but must not stop before it starts",
                        obstacle.start, obstacle.stop));
}

Eigen::Vector3d displacement_at(const Obstacle& obstacle, double time) noexcept {
    return std::max(std::min(time, obstacle.stop) - obstacle.start, 0.0) * obstacle.velocity;
}

Eigen::Vector3d mean_velocity(const Obstacle& obstacle, double time, double dt) noexcept {
    if (dt == 0) return Eigen::Vector3d::Zero();
    return (displacement_at(obstacle, time + dt) - displacement_at(obstacle, time)) / dt;
}

std::optional<SurfaceDistance> signed_distance(const Obstacle& obstacle, const Eigen::Vector3d& p,
                                               double time, double reach) noexcept {
    const Eigen::Vector3d local = p - displacement_at(obstacle, time);
    return std::visit([&](const auto& shape) { return distance_to(shape, local, reach); }, obstacle.shape);
}

}  // namespace nbd
