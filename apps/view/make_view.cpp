#include "apps/view/make_view.hpp"

#include <algorithm>
#include <deque>

#include "apps/view/bounds_view.hpp"
#include "apps/view/contact_finder.hpp"
#include "apps/view/node_stress.hpp"

namespace nbd {
namespace {

ViewObstacle shown(const Obstacle& obstacle, const std::vector<double>& times) {
    ViewObstacle result;
    if (const auto* plane = std::get_if<PlaneShape>(&obstacle.shape))
        result.shape = ViewPlane{plane->point, plane->normal};
    else if (const auto* ball = std::get_if<BallShape>(&obstacle.shape))
        result.shape = ViewBall{ball->centre, ball->radius};
    else {
        const TriMesh& mesh = std::get<std::shared_ptr<const StaticSurface>>(obstacle.shape)->mesh();
        result.shape = ViewMesh{mesh.X.cast<float>(), mesh.F};
    }
    if (!obstacle.velocity.isZero(0))
        for (const double time : times) result.shifts.push_back(displacement_at(obstacle, time));
    return result;
}

/// Appends the rows to a pose of several frames.
void append(Vertices& frames, std::size_t frame, const Vertices& x) {
    frames.middleRows(static_cast<Eigen::Index>(frame) * x.rows(), x.rows()) = x;
}

}  // namespace

std::vector<int> even_frames(int count, int most) {
    std::vector<int> frames;
    const long shown = std::min(count, most);
    for (long i = 0; i < shown; ++i)
        frames.push_back(shown == 1 ? 0
                                    : static_cast<int>((i * (count - 1) + (shown - 1) / 2) / (shown - 1)));
    return frames;
}

void make_view(const ViewSources& sources, ViewScene& scene) {
    std::deque<PosedBody> posed;
    std::vector<Vertices> rest;
    for (const ViewSource& source : sources.bodies) {
        PosedBody& body = posed.emplace_back(source.tree);
        rest.push_back(source.rest);
        ViewBody view;
        view.name = source.name;
        view.F = source.tree.tree->faces;
        view.W = source.tree.W;
        view.start = source.start;
        if (source.elastic) view.scalars.push_back({"von Mises stress", "Pa", {}});
        if (source.has_forces) view.scalars.push_back({"contact force", "N", {}});
        view.bounds = bounds_of(body.drawn());
        scene.is_audited = scene.is_audited || body.misses();
        scene.bodies.push_back(std::move(view));
    }
    for (const Obstacle& obstacle : sources.obstacles)
        scene.obstacles.push_back(shown(obstacle, scene.times));
    scene.contact_distance = sources.contact_distance;
    ContactFinder contacts(sources.contact_distance, sources.self_contact, sources.obstacles, rest, posed);
    Vertices x;
    for (std::size_t f = 0; f < scene.frames(); ++f) {
        for (std::size_t b = 0; b < posed.size(); ++b) {
            const ViewSource& source = sources.bodies[b];
            ViewBody& view = scene.bodies[b];
            sources.read_nodes(static_cast<int>(b), scene.numbers[f], x);
            if (f == 0) view.nodes.resize(static_cast<Eigen::Index>(scene.frames()) * x.rows(), 3);
            append(view.nodes, f, x);
            posed[b].begin_pose(x);
            add_bounds(posed[b].drawn(), *view.bounds);
            if (source.elastic) add_node_stress(*source.elastic, x.cast<double>(), view.scalars[0].values);
            if (!source.has_forces) continue;
            sources.read_forces(static_cast<int>(b), scene.numbers[f], x);
            const Eigen::VectorXf sizes = x.rowwise().norm();
            std::vector<float>& forces = view.scalars.back().values;
            forces.insert(forces.end(), sizes.begin(), sizes.end());
        }
        scene.pairs.push_back(contacts.add_frame(posed, scene.times[f], scene.bodies));
        if (sources.progress) sources.progress(static_cast<int>(f) + 1, static_cast<int>(scene.frames()));
    }
}

}  // namespace nbd
