#include "apps/audit.hpp"

#include <algorithm>

namespace nbd {
namespace {

/// How many of the exact pairs are not among the found ones. Both sorted.
long missing(std::span<const FacePair> exact, std::span<const FacePair> found) {
    std::vector<FacePair> missed;
    std::ranges::set_difference(exact, found, std::back_inserter(missed));
    return static_cast<long>(missed.size());
}

}  // namespace

AuditCount& AuditCount::operator+=(const AuditCount& other) {
    intersecting += other.intersecting;
    intersecting_missed += other.intersecting_missed;
    near += other.near;
    near_missed += other.near_missed;
    return *this;
}

Audit::Audit(const SceneSpec& spec, const std::vector<LoadedBody>& bodies) {
    for (std::size_t i = 0; i < bodies.size(); ++i) {
        const TriMesh& surface = bodies[i].body.surface;
        const auto tree =
            bodies[i].tree
                ? bodies[i].tree
                : std::make_shared<const CollisionTree>(make_exact_tree(surface.X.cast<float>(), surface.F));
        scene_.emplace_back(tree, spec.bodies[i].bounds, spec.bodies[i].margin);
        exact_.emplace_back(tree, BoundKind::exact);
    }
}

AuditCount Audit::check(World& world) {
    for (std::size_t i = 0; i < scene_.size(); ++i) {
        const Vertices& x = world.surface(static_cast<int>(i)).x_float();
        scene_[i].begin_pose(x, world.motion(static_cast<int>(i)));
        exact_[i].begin_pose(x);
    }
    const auto distance = static_cast<float>(world.thickness());
    AuditCount count;
    for (std::size_t a = 0; a < scene_.size(); ++a)
        for (std::size_t b = a + 1; b < scene_.size(); ++b) {
            const auto crossing = exact_query_.intersecting(exact_[a], exact_[b]);
            count.intersecting += static_cast<long>(crossing.size());
            count.intersecting_missed += missing(crossing, scene_query_.intersecting(scene_[a], scene_[b]));
            const auto near = exact_query_.within(exact_[a], exact_[b], distance);
            count.near += static_cast<long>(near.size());
            count.near_missed += missing(near, scene_query_.within(scene_[a], scene_[b], distance));
        }
    return count;
}

}  // namespace nbd
