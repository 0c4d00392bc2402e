#pragma once

#include <Eigen/Core>
#include <limits>
#include <memory>
#include <optional>
#include <variant>

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

/// A rigid obstacle that contacts do not move. It stands still or travels at a constant velocity for some
/// time.
struct Obstacle {
    std::variant<PlaneShape, BallShape, std::shared_ptr<const StaticSurface>> shape;  // pose before `start`
    Eigen::Vector3d velocity = Eigen::Vector3d::Zero();     // m/s between start and stop
    double friction = 0.5;                                  // Coulomb's coefficient, >= 0
    double start = 0;                                       // seconds
    double stop = std::numeric_limits<double>::infinity();  // seconds, >= start
};

/// Throws std::invalid_argument unless all numbers are finite, a normal is unit to 1e-6, a radius is positive
/// and a mesh is present.
void check_obstacle(const Obstacle& obstacle);

/// Displacement of the obstacle at `time`, metres.
Eigen::Vector3d displacement_at(const Obstacle& obstacle, double time) noexcept;

/// Mean velocity of the obstacle between `time` and time + dt, m/s.
Eigen::Vector3d mean_velocity(const Obstacle& obstacle, double time, double dt) noexcept;

/// Signed distance of p at `time` (seconds). May be nullopt if p is more than `reach` metres outside. At the
/// centre of a ball the normal is +z.
std::optional<SurfaceDistance> signed_distance(const Obstacle& obstacle, const Eigen::Vector3d& p,
                                               double time, double reach) noexcept;

}  // namespace nbd
