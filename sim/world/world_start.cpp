// The barrier of a world, and whether it can start.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

#include "sim/world/world.hpp"

namespace nbd {
namespace {

/// Whether each vertex hangs on these nodes alone.
std::vector<char> hanging_on(const std::vector<char>& nodes, const Embedding& W) {
    std::vector<char> hangs(W.rows(), 1);
    for (Eigen::Index v = 0; v < W.rows(); ++v)
        for (Embedding::InnerIterator it(W, v); it; ++it)
            if (it.value() != 0 && !nodes[it.col()]) hangs[v] = 0;
    return hangs;
}

}  // namespace

/// Made where it is first asked for.
Barrier& World::barrier() {
    if (barrier_) return *barrier_;
    auto made = std::make_unique<Barrier>(state_.config.contact, state_.thickness(), state_.pairs);
    for (const SteppedBody& body : state_.bodies)
        made->add_body(body.shape, body.elastic->rest(), body.contact_young, body.bounds, held_pose(body),
                       body.friction);
    for (const Obstacle& obstacle : state_.obstacles) made->add_obstacle(obstacle);
    made->begin();
    barrier_ = std::move(made);
    return *barrier_;
}

/// By the grips that have its nodes from the first. Driven nodes are told from step to step.
HeldPose World::held_pose(const SteppedBody& body) {
    if (body.added_at.size() == 0) return {};
    std::vector<char> held(body.added_at.rows(), 0), staying = held;
    for (std::size_t g = 0; g < body.grips.size(); ++g) {
        const Grip& grip = body.grips[g];
        if (body.takes_later(g)) continue;
        const bool is_for_ever =
            grip.motion.stays() && grip.release == std::numeric_limits<double>::infinity();
        for (const int node : grip.nodes) {
            held[node] = 1;
            staying[node] = is_for_ever;
        }
    }
    return {body.added_at, hanging_on(held, body.shape->W), hanging_on(staying, body.shape->W)};
}

std::vector<Intersection> World::intersecting_faces() {
    barrier().begin_step(state_.time, 0);
    return barrier().intersections(state_.nodes_now());
}

std::vector<Intersection> World::touching_at_rest() { return barrier().touching_at_rest(); }

void World::check_start() {
    if (start_is_checked_) return;
    barrier().be_exact(true);               // until the next part
    std::vector<std::array<int, 2>> pairs;  // bodies that are too near, or -1
    if (const auto found = intersecting_faces(); !found.empty()) {
        const std::vector<MovingSurface>& surfaces = barrier().surfaces();
        for (const Intersection& i : found)
            pairs.push_back({surfaces[i.surface_a].body(), surfaces[i.surface_b].body()});
        throw std::invalid_argument(fmt::format("bodies must start without intersections, but {}{}",
                                                intersection_text(found, surfaces), way_to_start(pairs)));
    }
    barrier().look(state_.nodes_now(), state_.nodes_now(), 0);
    if (!std::isfinite(barrier().energy(0))) {
        for (const Contact& contact : barrier().contacts(0))
            if (!(contact.gap > barrier().floor())) pairs.push_back({contact.a.body, contact.b.body});
        throw std::invalid_argument(fmt::format(
            "surfaces must start apart, but the nearest are {:.2g} m apart; allowed: more than {:.2g} m{}",
            barrier().least_distance(), barrier().floor(), way_to_start(pairs)));
    }
    start_is_checked_ = true;
}

/// What a person can do about bodies that start too near each other or an obstacle, -1; the end of a line.
std::string World::way_to_start(std::span<const std::array<int, 2>> pairs) const {
    for (const auto& [a, b] : pairs) {
        if (can_be_moved(a) || can_be_moved(b)) continue;
        if (a == b) return fmt::format("; body {} needs another shape or pose", a);
        if (a >= 0 && b >= 0)
            return fmt::format("; bodies {} and {} are held, so place them at least {:.2g} m apart", a, b,
                               state_.thickness());
        return fmt::format("; body {} is held, so place it at least {:.2g} m away", std::max(a, b),
                           state_.thickness());
    }
    return "; `resolve_start` moves bodies apart";
}

}  // namespace nbd
