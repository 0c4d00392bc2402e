#include "apps/view/make_view.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "sim/fem/stress.hpp"

namespace nbd {
namespace {

ViewObstacle shown(const Obstacle& obstacle) {
    ViewObstacle result;
    if (const auto* plane = std::get_if<PlaneShape>(&obstacle.shape))
        result.shape = ViewPlane{plane->point, plane->normal};
    else if (const auto* ball = std::get_if<BallShape>(&obstacle.shape))
        result.shape = ViewBall{ball->centre, ball->radius};
    else {
        const TriMesh& mesh = std::get<std::shared_ptr<const StaticSurface>>(obstacle.shape)->mesh();
        result.shape = ViewMesh{mesh.X.cast<float>(), mesh.F};
    }
    return result;
}

/// Appends the von Mises stress at the nodes of a body, Pa: means over the tetrahedra around each node,
/// weighted with their volumes at rest. Tetrahedra without a finite stress are left out. x: [N, 3] metres.
void add_node_stress(const ElasticBody& body, NodesRef x, std::vector<float>& stress) {
    const Eigen::VectorXd of_tets = von_mises_stress(body, x);
    const Tets& T = body.rest().T;
    Eigen::VectorXd sum = Eigen::VectorXd::Zero(body.node_count()), weight = sum;
    for (int t = 0; t < body.element_count(); ++t) {
        if (!std::isfinite(of_tets[t])) continue;
        const double volume = body.rest_volumes()[t];
        for (int c = 0; c < 4; ++c) {
            sum[T(t, c)] += volume * of_tets[t];
            weight[T(t, c)] += volume;
        }
    }
    for (int i = 0; i < body.node_count(); ++i) {
        const double mean = weight[i] > 0 ? sum[i] / weight[i] : 0;
        stress.push_back(static_cast<float>(std::min<double>(mean, std::numeric_limits<float>::max())));
    }
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
    for (const Obstacle& obstacle : sources_.obstacles) scene.obstacles.push_back(shown(obstacle));
    scene.contact_distance = sources_.contact_distance;
}

void ViewMaker::add_frame(std::size_t frame, ViewScene& scene) {
    const int number = scene.numbers[frame];
    const double time = scene.times[frame];
    for (std::size_t b = 0; b < posed_.size(); ++b) {
        const ViewSource& source = sources_.bodies[b];
        ViewBody& view = scene.bodies[b];
        sources_.read_nodes(b, number, x_);
        const Eigen::Index rows = x_.rows();
        if (frame == 0) view.nodes.resize(static_cast<Eigen::Index>(scene.frames()) * rows, 3);
        view.nodes.middleRows(static_cast<Eigen::Index>(frame) * rows, rows) = x_;
        posed_[b].begin_pose(x_);
        add_bounds(posed_[b], *view.bounds);
        if (source.elastic) add_node_stress(*source.elastic, x_.cast<double>(), view.scalars[0].values);
        if (!source.has_forces) continue;
        sources_.read_forces(b, number, x_);
        const Eigen::VectorXf sizes = x_.rowwise().norm();
        std::vector<float>& forces = view.scalars.back().values;
        forces.insert(forces.end(), sizes.begin(), sizes.end());
    }
    for (std::size_t i = 0; i < sources_.obstacles.size(); ++i)
        if (const Obstacle& obstacle = sources_.obstacles[i]; !obstacle.velocity.isZero(0))
            scene.obstacles[i].shifts.push_back(displacement_at(obstacle, time));
    scene.pairs.push_back(contacts_->add_frame(posed_, time, scene.bodies));
}

void make_view(const ViewSources& sources, ViewScene& scene) {
    ViewMaker maker(sources);
    maker.begin(scene);
    for (std::size_t f = 0; f < scene.frames(); ++f) {
        maker.add_frame(f, scene);
        if (sources.progress) sources.progress(static_cast<int>(f) + 1, scene.frames());
    }
}

ViewScene view_of_surfaces(std::vector<ViewSource> surfaces, const std::vector<Vertices>& poses,
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
    sources.read_nodes = [&](int body, int, Vertices& x) { x = poses[body]; };
    make_view(sources, scene);
    return scene;
}

}  // namespace nbd
