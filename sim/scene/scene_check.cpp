#include "sim/scene/scene_check.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <memory>
#include <stdexcept>
#include <utility>

#include "collision/query/pair_query.hpp"
#include "sim/scene/scene_parts.hpp"

namespace nbd {
namespace {

/// A body's surface at the start of the simulation.
struct StartSurface {
    std::size_t number;  // number of the body
    TriMesh mesh;
    Vertices x;
    PosedTree tree;
    Eigen::AlignedBox3d box;

    StartSurface(std::size_t body, TriMesh surface)
        : number(body),
          mesh(std::move(surface)),
          x(mesh.X.cast<float>()),
          tree(shared_exact_tree(x, mesh.F), BoundKind::exact),
          box(mesh.X.colwise().minCoeff().transpose(), mesh.X.colwise().maxCoeff().transpose()) {
        tree.begin_pose(x);
    }
    StartSurface(StartSurface&& other) = delete;
};

class SceneCheck {
 public:
    SceneCheck(const SceneReading& reading, std::span<const LoadedBody* const> bodies)
        : reading_(reading), bodies_(bodies) {}

    std::vector<std::string> run() {
        for (std::size_t b = 0; b < bodies_.size(); ++b)
            if (bodies_[b]) check_body(b);
        for (std::size_t a = 0; a < surfaces_.size(); ++a)
            for (std::size_t b = a + 1; b < surfaces_.size(); ++b) check_pair(*surfaces_[a], *surfaces_[b]);
        for (std::size_t o = 0; o < reading_.spec.obstacles.size(); ++o)
            if (reading_.obstacle_is_good[o]) check_obstacle(o);
        return std::move(problems_);
    }

 private:
    void check_body(std::size_t number) {
        const auto say = [&](const std::string& what) {
            problems_.push_back(fmt::format("bodies[{}]: {}", number, what));
        };
        SceneBody spec = reading_.spec.bodies[number];
        const std::vector<SceneGrip> grips = std::exchange(spec.grips, {});
        try {
            WorldBody body = make_world_body(
                spec, *bodies_[number],
                scene_elastic(spec, *bodies_[number], scene_materials(spec, *bodies_[number])));
            check_grips(number, grips, body.state.x);
            surfaces_.push_back(
                std::make_unique<StartSurface>(number, TriMesh{embedded(body.W, body.state.x), body.F}));
            World({}).add_body(std::move(body));
        } catch (const std::exception& error) {
            say(error.what());
        }
    }

    void check_grips(std::size_t number, const std::vector<SceneGrip>& grips, const Nodes& x) {
        std::vector<const SceneGrip*> holder(static_cast<std::size_t>(x.rows()), nullptr);
        for (const SceneGrip& grip : grips) {
            const std::vector<int> nodes = nodes_in(grip.region, x);
            const SceneGrip* other = nullptr;
            for (const int node : nodes) {
                const SceneGrip*& held_by = holder[static_cast<std::size_t>(node)];
                if (held_by && !other) other = held_by;
                held_by = &grip;
            }
            const auto say = [&](const std::string& what) {
                problems_.push_back(fmt::format("bodies[{}].{}: {}", number, grip.key, what));
            };
            if (nodes.empty()) say("the region holds no node of the body");
            if (other) say("contains nodes that " + other->key + " also holds");
        }
    }

    /// Whether vertex 0 of `inner` lies in `outer`. If the surfaces do not cross, all of `inner` does.
    static bool is_inside(const StartSurface& inner, const StartSurface& outer) {
        const Eigen::Vector3d p = inner.mesh.X.row(0);
        if (!outer.box.contains(p)) return false;
        const auto distance = StaticSurface(outer.mesh).distance(p, 0);
        return distance && distance->distance < 0;
    }

    void check_pair(StartSurface& a, StartSurface& b) {
        if (!a.box.intersects(b.box) || reading_.spec.resolve_start) return;
        const std::size_t crossing = query_.intersecting(a.tree, b.tree).size();
        if (crossing > 0)
            problems_.push_back(
                fmt::format("bodies[{}]: overlaps bodies[{}] at the start: {} pairs of faces cross", b.number,
                            a.number, crossing));
        else if (is_inside(a, b) || is_inside(b, a))
            problems_.push_back(fmt::format("bodies[{}]: lies inside bodies[{}] or encloses it at the start",
                                            b.number, a.number));
    }

    void check_obstacle(std::size_t number) {
        try {
            const Obstacle obstacle = make_obstacle(reading_.spec.obstacles[number]);
            nbd::check_obstacle(obstacle);
            if (reading_.spec.resolve_start) return;
            for (const auto& surface : surfaces_) check_start(number, obstacle, *surface);
        } catch (const std::exception& error) {
            problems_.push_back(fmt::format("obstacles[{}]: {}", number, error.what()));
        }
    }

    /// A body that rests on an obstacle may penetrate it slightly.
    void check_start(std::size_t number, const Obstacle& obstacle, const StartSurface& surface) {
        const double allowed = 1e-3 * surface.box.diagonal().norm();
        double deepest = 0;
        for (Eigen::Index i = 0; i < surface.mesh.X.rows(); ++i)
            if (const auto found = signed_distance(obstacle, surface.mesh.X.row(i).transpose(), 0, 0))
                deepest = std::max(deepest, -found->distance);
        if (deepest > allowed)
            problems_.push_back(fmt::format("bodies[{}]: is {:.3g} m deep in obstacles[{}] at the start",
                                            surface.number, deepest, number));
    }

    const SceneReading& reading_;
    std::span<const LoadedBody* const> bodies_;
    std::vector<std::unique_ptr<StartSurface>> surfaces_;
    PairQuery query_;
    std::vector<std::string> problems_;
};

}  // namespace

std::vector<std::string> scene_problems(const SceneReading& reading,
                                        std::span<const LoadedBody* const> bodies) {
    return SceneCheck(reading, bodies).run();
}

}  // namespace nbd
