#include "apps/simulate/audit.hpp"

#include "collision/base/stopwatch.hpp"
#include "collision/geometry/face_pair_set.hpp"
#include "collision/tree/auto_bounds.hpp"

namespace nbd {

AuditCount& AuditCount::operator+=(const AuditCount& other) {
    for (const AuditNumber& number : audit_numbers)
        std::visit([&](auto member) { this->*member += other.*member; }, number.member);
    return *this;
}

void Audit::Side::begin_poses(World& world, std::vector<HungSurface>& hung) {
    tests = 0;
    us = 0;
    for (std::size_t i = 0; i < trees.size(); ++i) {
        const int body = i;
        const bool takes_surface = hung[i].W.rows() > 0 && !trees[i].takes_nodes();
        if (takes_surface) apply_embedding(hung[i].W, world.state(body).x.cast<float>(), hung[i].x);
        const ScopedTimer timer(us);
        if (takes_surface)
            trees[i].begin_pose(hung[i].x);
        else
            world.begin_pose(body, trees[i]);
    }
}

std::span<const FacePair> Audit::Side::within(std::size_t a, std::size_t b, float distance) {
    const auto pairs = timed(us, [&] { return query.within(trees[a], trees[b], distance); });
    const QueryCounters& count = query.counters();
    tests += count.node_tests + count.box_tests + count.triangle_tests;
    return pairs;
}

Audit::Audit(const SceneSpec& spec, const std::vector<LoadedBody>& bodies) {
    for (std::size_t i = 0; i < bodies.size(); ++i) {
        const auto tree = scene_tree(spec.bodies[i], bodies[i]);
        const BoundKind bounds = exact_for_auto(*tree, spec.bodies[i].bounds);
        hung_.push_back({reads_nodes(bounds) ? tree->affine->weights() : SurfaceEmbedding()});
        scene_.trees.emplace_back(tree, bounds, spec.bodies[i].margin);
        exact_.trees.emplace_back(tree, BoundKind::exact);
    }
}

AuditCount Audit::check(World& world) {
    scene_.begin_poses(world, hung_);
    exact_.begin_poses(world, hung_);
    const float distance = world.thickness();
    const std::size_t bodies = exact_.trees.size();
    AuditCount count;
    for (std::size_t a = 0; a < bodies; ++a)
        for (std::size_t b = a + 1; b < bodies; ++b) {
            const auto near = exact_.within(a, b, distance);
            count.near += near.size();
            count.near_missed += missing_pairs(near, scene_.within(a, b, distance));
        }
    count.tests = scene_.tests;
    count.exact_tests = exact_.tests;
    count.us = scene_.us;
    count.exact_us = exact_.us;
    return count;
}

}  // namespace nbd
