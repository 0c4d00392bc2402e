#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <variant>

#include "sim/obstacles/motion.hpp"
#include "sim/obstacles/static_surface.hpp"

namespace nbd {

/// A half-space: everything behind the plane is solid.
struct PlaneShape {
    Eigen::Vector3d point = Eigen::Vector3d::Zero();
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  // unit, out of the solid
};

struct BallShape {
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();
    double radius = 1;  // metres, > 0
};

/// An obstacle that contacts do not move: it moves as it is told.
struct Obstacle {
    std::variant<PlaneShape, BallShape, std::shared_ptr<const StaticSurface>> shape;  // in its own place
    Motion motion{};
    double friction = 0.5;  // Coulomb's coefficient, >= 0
};

/// Throws std::invalid_argument unless all numbers are finite, a normal is unit to 1e-6, a radius is
/// positive, a mesh is present and the motion passes check_motion().
void check_obstacle(const Obstacle& obstacle);

/// Signed distance of p to the obstacle in its own place. May be nullopt if p is more than `reach` metres
/// outside. At the centre of a ball the normal is +z.
std::optional<SurfaceDistance> signed_distance_at_rest(const Obstacle& obstacle, const Eigen::Vector3d& p,
                                                       double reach) noexcept;

/// Likewise where it is moved to.
std::optional<SurfaceDistance> signed_distance(const Obstacle& obstacle, const Placing& placing,
                                               const Eigen::Vector3d& p, double reach) noexcept;

/// Likewise at `time`, seconds.
std::optional<SurfaceDistance> signed_distance(const Obstacle& obstacle, const Eigen::Vector3d& p,
                                               double time, double reach) noexcept;

}  // namespace nbd
