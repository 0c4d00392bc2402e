#include "sim/scene/build_world.hpp"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <stdexcept>
#include <utility>
#include <variant>
#include <vector>

#include "collision/base/notice.hpp"
#include "collision/geometry/far_origin.hpp"
#include "meshing/body/rigid_body.hpp"
#include "meshing/formats/read_surface.hpp"
#include "meshing/surface/solid_boundary.hpp"
#include "sim/scene/read_parts.hpp"
#include "sim/scene/scene_check.hpp"
#include "sim/world/hang_on_body.hpp"

namespace nbd {
namespace {

/// Velocities of a body that moves with the scene's velocity and rotates about its centre of mass.
Nodes rigid_velocities(const ElasticBody& elastic, const Nodes& x, const SceneBody& spec) {
    const Eigen::Vector3d centre = x.transpose() * elastic.node_masses() / elastic.mass();
    Nodes v(x.rows(), 3);
    for (Eigen::Index i = 0; i < x.rows(); ++i)
        v.row(i) = spec.velocity + spec.angular_velocity.cross(x.row(i).transpose() - centre);
    return v;
}

/// A rigid body is held by its four nodes or by none, and is not scaled.
void check_rigid_grips(const SceneBody& spec, const WorldBody& body) {
    for (std::size_t g = 0; g < body.grips.size(); ++g) {
        const Grip& grip = body.grips[g];
        if (grip.nodes.size() != 4)
            throw std::invalid_argument(fmt::format(
                "{}: the region holds {} of the 4 nodes of a rigid body, which lie outside of it; allowed: all, "
                "or a joint",
                spec.grips[g].key, grip.nodes.size()));
        for (const Keyframe& frame : grip.motion.keyframes)
            if (frame.scale != 1)
                throw std::invalid_argument(
                    fmt::format("{}: a rigid body cannot be scaled", spec.grips[g].key));
    }
}

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

void move(SceneObstacle& obstacle, const Eigen::Vector3d& by) {
    obstacle.obstacle.motion.centre += by;
    if (auto* plane = std::get_if<PlaneShape>(&obstacle.obstacle.shape))
        plane->point += by;
    else if (auto* ball = std::get_if<BallShape>(&obstacle.obstacle.shape))
        ball->centre += by;
    else
        obstacle.placement.translate += by;
}

void move(Joint& joint, const Eigen::Vector3d& by) {
    if (auto* ball = std::get_if<BallJoint>(&joint.kind)) ball->point += by;
    if (auto* hinge = std::get_if<HingeJoint>(&joint.kind)) hinge->point += by;
    if (auto* slider = std::get_if<SliderJoint>(&joint.kind)) slider->point += by;
    if (auto* cord = std::get_if<CordJoint>(&joint.kind)) {
        cord->from += by;
        cord->to += by;
    }
}

/// The surface that a region is near to, where it is at time 0; none if it is not there or was not loaded.
std::optional<Obstacle> surface_of(const NearSurface& near, const SceneSpec& spec,
                                   std::span<const LoadedBody> bodies) {
    for (std::size_t b = 0; b < bodies.size(); ++b) {
        if (near.body.empty() || spec.bodies[b].name != near.body || !bodies[b].body) continue;
        const TriMesh& rest = bodies[b].body->surface;
        return Obstacle{.shape = std::make_shared<const StaticSurface>(
                            TriMesh{placed(rest.X, spec.bodies[b].placement), rest.F})};
    }
    for (const SceneObstacle& obstacle : spec.obstacles) {
        if (near.obstacle.empty() || obstacle.name != near.obstacle) continue;
        try {
            return make_obstacle(obstacle);
        } catch (const std::exception&) {  // told where the obstacle is made
            return std::nullopt;
        }
    }
    return std::nullopt;
}

/// Calls act(), and puts the body's place in the scene before the message of what it throws.
template <class Act>
void naming_body(const SceneSpec& spec, std::size_t b, const Act& act) {
    try {
        act();
    } catch (const std::invalid_argument& error) {
        throw std::invalid_argument(fmt::format("bodies[{}] ({}): {}", b, spec.bodies[b].name, error.what()));
    }
}

}  // namespace

std::shared_ptr<const CollisionTree> scene_tree(const SceneBody& spec, const LoadedBody& loaded) {
    const Body& body = *loaded.body;
    const bool hangs = reads_nodes(spec.bounds);
    if (!loaded.tree && can_miss(spec.bounds))
        throw std::invalid_argument(fmt::format("bounds \"{}\" need a tree", name(spec.bounds)));
    if (loaded.tree && (!hangs || loaded.tree->affine)) return loaded.tree;
    CollisionTree tree =
        loaded.tree ? *loaded.tree : make_exact_tree(body.surface.X.cast<float>(), body.surface.F);
    if (spec.bounds == BoundKind::affine)
        hang_on_nodes(tree, body.float_weights(), body.tets.X.cast<float>());
    else if (hangs)
        hang_on_body(tree, body, spec.name);
    return std::make_shared<const CollisionTree>(std::move(tree));
}

WorldBody make_world_body(const SceneBody& spec, const LoadedBody& loaded,
                          std::shared_ptr<const ElasticBody> elastic) {
    const Body& body = *loaded.body;
    WorldBody result{.elastic = std::move(elastic),
                     .W = body.W,
                     .F = body.surface.F,
                     .tree = scene_tree(spec, loaded),
                     .bounds = spec.bounds,
                     .margin = spec.margin};
    result.state.x = placed(body.tets.X, spec.placement);
    result.state.v = rigid_velocities(*result.elastic, result.state.x, spec);
    const PlacedBody placed_body{body, result.state.x};
    result.friction = surface_friction(spec, placed_body);
    for (const SceneGrip& grip : spec.grips) result.grips.push_back(take_nodes(grip, placed_body));
    if (const auto odds = grips_at_odds(result.grips))
        throw std::invalid_argument(
            at_odds_text(spec.grips[odds->second].key, spec.grips[odds->first].key, odds->from));
    if (is_rigid(body.tets)) check_rigid_grips(spec, result);
    for (std::size_t k = 0; k < spec.loads.size(); ++k) {
        result.loads.push_back(take_part(spec.loads[k], placed_body, spec.placement.rotation()));
        check_gas_load(spec, result, k);
    }
    check_loads(spec, result);
    return result;
}

namespace {

/// The joint, with the places of a weld.
Joint make_joint(const SceneJoint& spec, const World& world, const Body& body) {
    Joint joint = spec.joint;
    auto* weld = std::get_if<WeldJoint>(&joint.kind);
    if (!weld) return joint;
    if (!spec.region) throw std::invalid_argument(fmt::format("{}.weld.region: is missing", spec.key));
    const bool is_rigid = world.elastic(joint.a).is_rigid();
    const Nodes &nodes = world.state(joint.a).x, x = is_rigid ? world.surface(joint.a) : nodes;
    const std::vector<int> inside = parts_in(spec.key + ".weld.region", *spec.region,
                                             is_rigid ? BodyPart::vertex : BodyPart::node, {body, nodes});
    constexpr std::size_t least = 3;  // fewer let the two turn
    if (inside.size() < least)
        throw std::invalid_argument(
            fmt::format("{}.weld.region: holds {} of the {} of the first body; allowed: {} or more", spec.key,
                        inside.size(), is_rigid ? "vertices" : "nodes", least));
    weld->places = x(inside, Eigen::all);
    const Nodes apart = weld->places.rowwise() - weld->places.colwise().mean();
    const Eigen::Vector3d spread =
        Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(apart.transpose() * apart, Eigen::EigenvaluesOnly)
            .eigenvalues();
    constexpr double flat = 1e-12;
    if (!(spread[1] > flat * spread[2]))
        throw std::invalid_argument(fmt::format(
            "{}.weld.region: holds places on one line, about which the two would turn", spec.key));
    return joint;
}

}  // namespace

void add_joint(const SceneJoint& spec, World& world, const Body& body) {
    Joint joint = make_joint(spec, world, body);
    try {
        world.add_joint(std::move(joint));
    } catch (const std::invalid_argument& error) {
        throw std::invalid_argument(fmt::format("{}: {}", spec.key, error.what()));
    }
}

namespace {

/// Of a surface that deforms by a recording.
Obstacle make_recorded_obstacle(const SceneObstacle& spec) {
    if (!spec.frames) throw std::invalid_argument("recording: was not loaded");
    check_frames(*spec.frames, spec.made.X.rows());
    SurfaceFrames frames = *spec.frames;
    for (Nodes& x : frames.positions) x = placed(x, spec.placement);
    Obstacle obstacle = spec.obstacle;
    obstacle.shape = std::make_shared<const StaticSurface>(TriMesh{frames.at(0), spec.made.F});
    obstacle.frames = std::make_shared<const SurfaceFrames>(std::move(frames));
    return obstacle;
}

}  // namespace

Obstacle make_obstacle(const SceneObstacle& spec) {
    Obstacle obstacle = spec.obstacle;
    if (spec.recording) return make_recorded_obstacle(spec);
    if (spec.mesh.empty() && spec.made.F.rows() == 0 && !spec.heights) return obstacle;
    TriMesh mesh = spec.heights        ? spec.heights->mesh()
                   : spec.mesh.empty() ? spec.made
                                       : read_surface(spec.mesh);
    if (const int turned = turn_outward(mesh); turned > 0)
        notice(fmt::format(
            "{}: {} of its {} faces looked inward and were turned: an obstacle is solid within its surface",
            spec.mesh.string(), turned == mesh.F.rows() ? "all" : std::to_string(turned), mesh.F.rows()));
    mesh.X = placed(mesh.X, spec.placement);
    auto surface = std::make_shared<const StaticSurface>(std::move(mesh));
    if (surface->is_open() && !spec.mesh.empty())
        notice(fmt::format("{}: its surface is open, so the obstacle is a sheet with two sides, not solid",
                           spec.mesh.string()));
    obstacle.shape = std::move(surface);
    return obstacle;
}

void make_trees(const SceneSpec& spec, std::span<LoadedBody> bodies) {
    const std::vector<LoadedBody> loaded(bodies.begin(), bodies.end());
    for (std::size_t b = 0; b < bodies.size(); ++b) {
        std::size_t same = 0;
        while (same < b && !(loaded[same].body == loaded[b].body && loaded[same].tree == loaded[b].tree &&
                             spec.bodies[same].bounds == spec.bodies[b].bounds))
            ++same;
        naming_body(spec, b, [&] {
            bodies[b].tree = same < b ? bodies[same].tree : scene_tree(spec.bodies[b], loaded[b]);
        });
    }
}

SceneSpec local_scene(SceneSpec spec, std::span<const LoadedBody> bodies,
                      std::optional<Eigen::Vector3d> wanted) {
    if (spec.origin) return spec;
    const Eigen::Vector3d origin = wanted ? *wanted : origin_of(spec, bodies);
    spec.origin = origin;
    for (std::size_t b = 0; b < bodies.size(); ++b)
        if (const Body* body = bodies[b].body.get(); body && !body->origin.isZero(0))
            spec.bodies[b].placement.translate += placed_origin(*body, spec.bodies[b].placement);
    for (SceneBody& body : spec.bodies) {
        body.placement.translate -= origin;
        for (SceneLoad& load : body.loads)
            for (Eigen::Vector3d& point : load.along) point -= origin;
        for (SceneGrip& grip : body.grips) grip.grip.motion.centre -= origin;
    }
    for (SceneObstacle& obstacle : spec.obstacles) move(obstacle, -origin);
    for (SceneJoint& joint : spec.joints) move(joint.joint, -origin);
    std::map<std::string, std::optional<Obstacle>> surfaces;
    for (Region* region : regions_of(spec)) {
        move(*region, -origin);
        if (auto* near = std::get_if<NearSurface>(&region->part)) {
            const auto [known, is_new] = surfaces.try_emplace(near->body + "\n" + near->obstacle);
            if (is_new) known->second = surface_of(*near, spec, bodies);
            near->surface = known->second;
        }
    }
    return spec;
}

World build_world(const SceneSpec& given, std::span<const LoadedBody> bodies, std::vector<StartMove>* moves) {
    if (bodies.size() != given.bodies.size())
        throw std::invalid_argument(
            fmt::format("scene: it has {} bodies, but {} were loaded", given.bodies.size(), bodies.size()));
    const SceneSpec spec = local_scene(given, bodies);
    World world({.gravity = spec.gravity,
                 .gravity_keys = spec.gravity_keys,
                 .contact = spec.contact,
                 .step = spec.step,
                 .statics = spec.time.statics,
                 .origin = *spec.origin});
    std::vector<std::shared_ptr<const ElasticBody>> elastic(bodies.size());
    std::vector<BodyMaterials> materials(bodies.size());
    for (std::size_t b = 0; b < bodies.size(); ++b)
        naming_body(spec, b, [&] {
            materials[b] = scene_materials(spec.bodies[b], bodies[b]);
            for (std::size_t a = 0; a < b && !elastic[b]; ++a)
                if (bodies[a].body == bodies[b].body &&
                    spec.bodies[a].placement.scale == spec.bodies[b].placement.scale &&
                    materials[a] == materials[b])
                    elastic[b] = elastic[a];
            if (!elastic[b]) elastic[b] = scene_elastic(spec.bodies[b], bodies[b], materials[b]);
            WorldBody body = make_world_body(spec.bodies[b], bodies[b], elastic[b]);
            body.name = body_labels(spec)[b];
            world.add_body(std::move(body));
        });
    for (std::size_t o = 0; o < spec.obstacles.size(); ++o) {
        try {
            world.add_obstacle(make_obstacle(spec.obstacles[o]));
        } catch (const std::invalid_argument& error) {
            throw std::invalid_argument(fmt::format("obstacles[{}]: {}", o, error.what()));
        }
    }
    for (const ScenePair& pair : spec.pairs) world.set_pair(pair.a, pair.b, pair.rule);
    for (const SceneJoint& joint : spec.joints) add_joint(joint, world, *bodies[joint.joint.a].body);
    for (int t = 0; t < std::ssize(spec.tendons); ++t) {
        Tendon tendon = spec.tendons[t];
        for (int j = 0; j < std::ssize(spec.joints); ++j)
            if (spec.joints[j].tendon == t) tendon.parts.push_back(j);
        world.add_tendon(std::move(tendon));
    }
    if (moves)
        *moves = move_apart(spec, world);
    else if (spec.resolve_start)
        world.resolve_start();
    return world;
}

}  // namespace nbd
