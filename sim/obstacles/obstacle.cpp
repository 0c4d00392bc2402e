#include "sim/obstacles/obstacle.hpp"

#include <fmt/format.h>

#include <cmath>
#include <stdexcept>
#include <string>

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

bool Obstacle::stands() const {
    return motion.stands() && (!frames || frames->stand(frames->times.front(), frames->times.back()));
}

void check_obstacle(const Obstacle& obstacle) {
    std::visit([](const auto& shape) { check_shape(shape); }, obstacle.shape);
    try {
        check_motion(obstacle.motion);
    } catch (const std::invalid_argument& error) {
        throw std::invalid_argument(std::string("obstacle: ") + error.what());
    }
    if (obstacle.frames) {
        const auto* mesh = std::get_if<std::shared_ptr<const StaticSurface>>(&obstacle.shape);
        if (!mesh) throw std::invalid_argument("obstacle: only a mesh can deform");
        check_frames(*obstacle.frames, (*mesh)->mesh().X.rows());
    }
    if (!(obstacle.friction >= 0) || !std::isfinite(obstacle.friction))
        throw std::invalid_argument(
            fmt::format("obstacle: friction is {}, but must be >= 0", obstacle.friction));
}

Nodes mesh_positions(const Obstacle& obstacle, double time) {
    if (obstacle.frames) return obstacle.frames->at(time);
    return std::get<std::shared_ptr<const StaticSurface>>(obstacle.shape)->mesh().X;
}

Obstacle as_at(const Obstacle& obstacle, double time) {
    if (!obstacle.frames) return obstacle;
    Obstacle rigid = obstacle;
    const TriMesh& mesh = std::get<std::shared_ptr<const StaticSurface>>(obstacle.shape)->mesh();
    rigid.shape = std::make_shared<const StaticSurface>(TriMesh{mesh_positions(obstacle, time), mesh.F});
    rigid.frames = nullptr;
    return rigid;
}

std::optional<SurfaceDistance> signed_distance_at_rest(const Obstacle& obstacle, const Eigen::Vector3d& p,
                                                       double reach) noexcept {
    return std::visit([&](const auto& shape) { return distance_to(shape, p, reach); }, obstacle.shape);
}

std::optional<SurfaceDistance> signed_distance(const Obstacle& obstacle, const Placing& placing,
                                               const Eigen::Vector3d& p, double reach) noexcept {
    std::optional<SurfaceDistance> found =
        signed_distance_at_rest(obstacle, placing.inverse(p), reach / placing.scale);
    if (!found || placing.is_shift) return found;
    found->distance *= placing.scale;
    found->normal = placing.turn * found->normal;
    return found;
}

std::optional<SurfaceDistance> signed_distance(const Obstacle& obstacle, const Eigen::Vector3d& p,
                                               double time, double reach) noexcept {
    return signed_distance(obstacle, obstacle.motion.at(time), p, reach);
}

}  // namespace nbd
