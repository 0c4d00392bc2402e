#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <variant>

#include "sim/obstacles/motion.hpp"
#include "sim/obstacles/static_surface.hpp"
#include "sim/obstacles/surface_frames.hpp"

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
    // Of a mesh that deforms: where its vertices are in its own place, in place of those of the shape, which
    // is as at time 0. The motion displaces them. Null: it is rigid.
    std::shared_ptr<const SurfaceFrames> frames{};

    /// Whether it is in one place for ever.
    bool stands() const;
};

/// Throws std::invalid_argument unless all numbers are finite, a normal is unit to 1e-6, a radius is
/// positive, a mesh is present, the motion passes
/// check_motion() and frames, which only meshes have, check_frames().
void check_obstacle(const Obstacle& obstacle);

/// Where the vertices of a mesh are in its own place at a time, seconds.
Nodes mesh_positions(const Obstacle& obstacle, double time);
/// A rigid obstacle that is, at a time, where this one is.
Obstacle as_at(const Obstacle& obstacle, double time);

/// Signed distance of p to the obstacle in its own place, of one that deforms as at time 0. May be nullopt if
/// p is more than `reach` metres outside. At the centre of a ball the normal is +z.
std::optional<SurfaceDistance> signed_distance_at_rest(const Obstacle& obstacle, const Eigen::Vector3d& p,
                                                       double reach) noexcept;

/// Likewise where it is moved to.
std::optional<SurfaceDistance> signed_distance(const Obstacle& obstacle, const Placing& placing,
                                               const Eigen::Vector3d& p, double reach) noexcept;

/// Likewise at `time`, seconds.
std::optional<SurfaceDistance> signed_distance(const Obstacle& obstacle, const Eigen::Vector3d& p,
                                               double time, double reach) noexcept;

}  // namespace nbd
