#include "sim/scene/local_scene.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <limits>
#include <utility>
#include <variant>

#include "collision/geometry/far_origin.hpp"

namespace nbd {
namespace {

/// Where the origin of a body lies once it is placed, less the placement's own translation.
Eigen::Vector3d placed_origin(const Body& body, const Placement& placement) {
    return placement.scale * (placement.rotation() * body.origin);
}

Eigen::Vector3d origin_of(const SceneSpec& spec, std::span<const LoadedBody> bodies) {
    Eigen::AlignedBox3d box;
    double edge = std::numeric_limits<double>::infinity();
    for (std::size_t b = 0; b < bodies.size(); ++b) {
        if (!bodies[b].body) continue;
        const Body& body = *bodies[b].body;
        const Placement& placement = spec.bodies[b].placement;
        const Eigen::Matrix3d A = placement.scale * placement.rotation();
        const Eigen::Vector3d t = placed_origin(body, placement) + placement.translate;
        const Nodes& X = body.surface.X;
        for (Eigen::Index v = 0; v < X.rows(); ++v) box.extend(A * X.row(v).transpose() + t);
        edge = std::min(edge, placement.scale * mean_edge(X, body.surface.F));
    }
    return far_origin(box, edge);
}

void move(Region& region, const Eigen::Vector3d& by) {
    if (auto* box = std::get_if<BoxRegion>(&region)) {
        box->min += by;
        box->max += by;
    } else {
        std::get<BallRegion>(region).centre += by;
    }
}

void move(SceneObstacle& obstacle, const Eigen::Vector3d& by) {
    if (auto* plane = std::get_if<PlaneShape>(&obstacle.obstacle.shape))
        plane->point += by;
    else if (auto* ball = std::get_if<BallShape>(&obstacle.obstacle.shape))
        ball->centre += by;
    else
        obstacle.placement.translate += by;
}

}  // namespace

SceneSpec local_scene(SceneSpec spec, std::span<const LoadedBody> bodies,
                      std::optional<Eigen::Vector3d> wanted) {
    if (spec.origin) return spec;
    const Eigen::Vector3d origin = wanted ? *wanted : origin_of(spec, bodies);
    spec.origin = origin;
    for (std::size_t b = 0; b < bodies.size(); ++b)
        if (const Body* body = bodies[b].body.get(); body && !body->origin.isZero(0))
            spec.bodies[b].placement.translate += placed_origin(*body, spec.bodies[b].placement);
    if (origin.isZero(0)) return spec;
    for (SceneBody& body : spec.bodies) {
        body.placement.translate -= origin;
        for (SceneMaterialRegion& region : body.regions)
            if (region.group.empty()) move(region.where, -origin);
        for (SceneGrip& grip : body.grips) {
            move(grip.region, -origin);
            grip.motion.centre -= origin;
        }
    }
    for (SceneObstacle& obstacle : spec.obstacles) move(obstacle, -origin);
    return spec;
}

}  // namespace nbd
