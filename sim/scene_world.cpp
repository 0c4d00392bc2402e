#include <fmt/format.h>

#include <stdexcept>
#include <utility>

#include "meshing/read_surface.hpp"
#include "sim/exact_tree.hpp"
#include "sim/scene.hpp"

namespace nbd {
namespace {

Nodes placed(const Nodes& X, const Placement& placement) {
    return (placement.scale * X * placement.rotation().transpose()).rowwise() +
           placement.translate.transpose();
}

bool contains(const BoxRegion& box, const Eigen::Vector3d& p) {
    return (p.array() >= box.min.array()).all() && (p.array() <= box.max.array()).all();
}

bool contains(const BallRegion& ball, const Eigen::Vector3d& p) {
    return (p - ball.centre).norm() <= ball.radius;
}

Grip take_nodes(const SceneGrip& from, const Nodes& x) {
    Grip grip = from.motion;
    for (int i = 0; i < x.rows(); ++i)
        if (std::visit([&](const auto& region) { return contains(region, x.row(i).transpose()); },
                       from.region))
            grip.nodes.push_back(i);
    if (grip.nodes.empty()) throw std::invalid_argument("a pin's or grip's region holds no node");
    return grip;
}

WorldBody make_body(const SceneBody& spec, const LoadedBody& loaded) {
    const Body& body = loaded.body;
    Material material = body.material;
    spec.material.apply(material);
    TetMesh tets = body.tets;
    tets.X *= spec.placement.scale;
    WorldBody result{.elastic = std::make_shared<const ElasticBody>(std::move(tets), material),
                     .W = body.W,
                     .F = body.surface.F,
                     .tree = loaded.tree,
                     .bounds = spec.bounds,
                     .margin = static_cast<float>(spec.margin)};
    if (!result.tree) {
        if (spec.bounds != BoundKind::exact)
            throw std::invalid_argument(fmt::format("bounds \"{}\" need a tree", name(spec.bounds)));
        result.tree = exact_tree(body.surface);
    }
    result.state.x = placed(body.tets.X, spec.placement);
    result.state.v = Nodes::Zero(result.state.x.rows(), 3).rowwise() + spec.velocity.transpose();
    for (const SceneGrip& grip : spec.grips) result.grips.push_back(take_nodes(grip, result.state.x));
    return result;
}

Obstacle make_obstacle(const SceneObstacle& spec) {
    Obstacle obstacle = spec.obstacle;
    if (spec.mesh.empty()) return obstacle;
    TriMesh mesh = read_surface(spec.mesh);
    mesh.X = placed(mesh.X, spec.placement);
    obstacle.shape = std::make_shared<const StaticSurface>(std::move(mesh));
    return obstacle;
}

}  // namespace

World build_world(const SceneSpec& spec, std::span<const LoadedBody> bodies) {
    if (bodies.size() != spec.bodies.size())
        throw std::invalid_argument(
            fmt::format("scene: it has {} bodies, but {} were loaded", spec.bodies.size(), bodies.size()));
    World world({.gravity = spec.gravity, .contact = spec.contact});
    for (std::size_t b = 0; b < bodies.size(); ++b) {
        try {
            world.add_body(make_body(spec.bodies[b], bodies[b]));
        } catch (const std::invalid_argument& error) {
            throw std::invalid_argument(
                fmt::format("bodies[{}] ({}): {}", b, spec.bodies[b].name, error.what()));
        }
    }
    for (std::size_t o = 0; o < spec.obstacles.size(); ++o) {
        try {
            world.add_obstacle(make_obstacle(spec.obstacles[o]));
        } catch (const std::invalid_argument& error) {
            throw std::invalid_argument(fmt::format("obstacles[{}]: {}", o, error.what()));
        }
    }
    return world;
}

}  // namespace nbd
