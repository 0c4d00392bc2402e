#include "apps/view/make_view.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "sim/fem/stress.hpp"

namespace nbd {
namespace {

/// Appends the von Mises stress at the nodes of a body, Pa: means over the tetrahedra around each node,
/// weighted with their volumes at rest. Tetrahedra without a finite stress are left out. x: [N, 3] metres.
void add_node_stress(const ElasticBody& body, NodesRef x, std::vector<float>& stress) {
    const Eigen::VectorXd of_tets = von_mises_stress(body, x);
    Eigen::VectorXd sum = Eigen::VectorXd::Zero(body.node_count()), weight = sum;
    for (int p = 0; p < body.point_count(); ++p) {
        const int t = p / body.points_per_tet();
        if (!std::isfinite(of_tets[t])) continue;
        const double volume = body.rest_volumes()[t];
        for (const int node : body.corner_tets().row(p)) {
            sum[node] += volume * of_tets[t];
            weight[node] += volume;
        }
    }
    for (int i = 0; i < body.node_count(); ++i) {
        const double mean = weight[i] > 0 ? sum[i] / weight[i] : 0;
        stress.push_back(static_cast<float>(std::min<double>(mean, std::numeric_limits<float>::max())));
    }
}

}  // namespace

ViewReaction view_reaction(int body, const Eigen::Vector3d& force, const Eigen::Vector3d& torque,
                           const Eigen::Vector3d& point, const Eigen::Vector3d& origin) {
    return {.body = body,
            .point = (point - origin).cast<float>(),
            .force = force.cast<float>(),
            .torque = (torque - point.cross(force)).cast<float>()};
}

std::string from_origin(const Eigen::Vector3d& origin) {
    if (origin.isZero(0)) return {};
    return fmt::format(", from ({}, {}, {}) m", origin.x(), origin.y(), origin.z());
}

Eigen::Vector3d up_of(const SceneSpec& spec) {
    if (spec.gravity.norm() > 0) return -spec.gravity.normalized();
    return Eigen::Vector3d::UnitZ();
}

ViewSources sources_of_scene(const SceneSpec& spec, std::span<const LoadedBody> bodies,
                             std::shared_ptr<const World> world) {
    ViewSources sources;
    for (std::size_t b = 0; b < bodies.size(); ++b) {
        const int body = b;
        const SceneBody& of_scene = spec.bodies[b];
        ViewSource& source = sources.bodies.emplace_back();
        source.name = of_scene.name;
        source.tree = {
            .tree = bodies[b].tree,
            .W = bodies[b].body->float_weights(),
            .bounds = of_scene.bounds,
            .margin = of_scene.margin ? std::optional(static_cast<float>(*of_scene.margin)) : std::nullopt};
        source.rest = embedded(source.tree.W, world->elastic(body).rest().X.cast<float>());
        source.elastic = std::shared_ptr<const ElasticBody>(world, &world->elastic(body));
    }
    sources.obstacles.assign(world->obstacles().begin(), world->obstacles().end());
    sources.contact_distance = world->thickness();
    sources.self_contact = true;
    return sources;
}

std::vector<int> even_frames(int count, int most) {
    std::vector<int> frames;
    const long shown = std::min(count, most);
    for (long i = 0; i < shown; ++i)
        frames.push_back(shown == 1 ? 0
                                    : static_cast<int>((i * (count - 1) + (shown - 1) / 2) / (shown - 1)));
    return frames;
}

ViewMaker::ViewMaker(ViewSources sources) : sources_(std::move(sources)) {
    std::vector<Vertices> rest;
    for (const ViewSource& source : sources_.bodies) {
        posed_.emplace_back(source.tree);
        rest.push_back(source.rest);
    }
    contacts_.emplace(sources_.contact_distance, sources_.self_contact, sources_.obstacles, rest, posed_);
}

void ViewMaker::begin(ViewScene& scene) {
    for (std::size_t b = 0; b < posed_.size(); ++b) {
        const ViewSource& source = sources_.bodies[b];
        ViewBody view;
        view.name = source.name;
        view.F = source.tree.tree->faces;
        view.W = source.tree.W;
        view.start = source.start;
        if (source.elastic) view.scalars.push_back({"von Mises stress", "Pa", {}});
        if (source.has_forces) view.scalars.push_back({"contact force", "N", {}});
        view.bounds = bounds_of(posed_[b]);
        scene.is_audited = scene.is_audited || posed_[b].misses();
        scene.bodies.push_back(std::move(view));
    }
    for (const Obstacle& obstacle : sources_.obstacles) scene.obstacles.push_back({obstacle});
    scene.contact_distance = sources_.contact_distance;
}

void ViewMaker::add_frame(std::size_t number, const ShownFrame& frame, ViewScene& scene) {
    const double time = scene.times[number];
    for (std::size_t b = 0; b < posed_.size(); ++b) {
        const ViewSource& source = sources_.bodies[b];
        ViewBody& view = scene.bodies[b];
        const Vertices& x = frame.nodes[b];
        if (number == 0) view.nodes.resize(static_cast<Eigen::Index>(scene.frames()) * x.rows(), 3);
        view.nodes.middleRows(static_cast<Eigen::Index>(number) * x.rows(), x.rows()) = x;
        posed_[b].begin_pose(x);
        add_bounds(posed_[b], *view.bounds);
        if (source.elastic) add_node_stress(*source.elastic, x.cast<double>(), view.scalars[0].values);
        if (!source.has_forces) continue;
        const Eigen::VectorXf sizes = frame.contact_forces[b].rowwise().norm();
        std::vector<float>& forces = view.scalars.back().values;
        forces.insert(forces.end(), sizes.begin(), sizes.end());
    }
    for (auto& [obstacle, places] : scene.obstacles)
        if (!obstacle.motion.stays()) places.push_back(obstacle.motion.at(time));
    if (scene.has_reactions) scene.reactions.push_back(frame.reactions);
    scene.pairs.push_back(contacts_->add_frame(posed_, time, scene.bodies));
}

ViewScene view_of_surfaces(std::vector<ViewSource> surfaces, std::vector<Vertices> poses,
                           const std::string& title, double distance) {
    ViewScene scene;
    scene.title = title;
    scene.displacement_from = "rest";
    scene.times = {0};
    scene.numbers = {0};
    scene.recorded_frames = 1;
    ViewSources sources;
    sources.bodies = std::move(surfaces);
    sources.contact_distance = distance;
    ViewMaker maker(std::move(sources));
    maker.begin(scene);
    maker.add_frame(0, {.nodes = std::move(poses)}, scene);
    return scene;
}

}  // namespace nbd
