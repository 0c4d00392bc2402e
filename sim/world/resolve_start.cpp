// Moves bodies apart before the first step without intersections.
#include <fmt/format.h>

#include <limits>
#include <map>
#include <stdexcept>
#include <utility>

#include "collision/base/stop.hpp"
#include "sim/world/world.hpp"

namespace nbd {
namespace {

constexpr int max_rounds = 64;

Eigen::Vector3d middle(const Nodes& x) {
    return (x.colwise().minCoeff() + x.colwise().maxCoeff()).transpose() / 2;
}

}  // namespace

std::vector<StartMove> World::resolve_start() {
    const WorldSnapshot start = snapshot();
    std::vector<StartMove> moves;
    for (int b = 0; b < body_count(); ++b) moves.push_back({b, Eigen::Vector3d::Zero()});
    const auto can_move = [&](int body) {
        return body >= 0 && at(body).grips.empty() && at(body).driven.nodes.empty();
    };
    const auto move = [&](int body, const Eigen::Vector3d& by) {
        at(body).state.x.rowwise() += by.transpose();
        moves[body].by += by;
    };
    const double room = 2 * thickness();
    std::vector<Intersection> found;
    int stuck = -1;  // a body that is in an obstacle
    for (int round = 0; round < max_rounds; ++round) {
        if (stop_asked()) {
            reset(start);
            throw StopAsked();
        }
        stuck = -1;
        for (int b = 0; b < body_count(); ++b)
            for (const Obstacle& obstacle : obstacles_)
                if (const Eigen::Vector3d by = way_out(at(b), obstacle, room); !by.isZero(0)) {
                    stuck = b;
                    if (can_move(b)) move(b, by);
                }
        // Moves two bodies apart by `by`, or the one that can move.
        const auto part = [&](int a, int b, const Eigen::Vector3d& by) {
            const double share = can_move(a) && can_move(b) ? 0.5 : 1;
            if (can_move(a)) move(a, share * by);
            if (can_move(b)) move(b, -share * by);
        };
        found = intersecting_faces();
        if (found.empty()) {
            const std::vector<Contact> near = too_near();
            if (near.empty() && stuck < 0) break;
            for (const Contact& c : near) part(c.a.body, c.b.body, (room - c.gap) * c.normal);
        }
        const std::vector<MovingSurface>& surfaces = barrier().surfaces();
        std::map<std::pair<int, int>, std::vector<Intersection>> by_pair;
        for (const Intersection& i : found) by_pair[{i.surface_a, i.surface_b}].push_back(i);
        for (const auto& [pair, intersections] : by_pair) {
            const MovingSurface &a = surfaces[pair.first], &b = surfaces[pair.second];
            if (pair.first == pair.second || a.is_obstacle() || b.is_obstacle() ||
                !(can_move(a.body()) || can_move(b.body())))
                continue;
            Eigen::Vector3d along = middle(a.begin_points()) - middle(b.begin_points());
            along = along.norm() > 0 ? along.normalized() : Eigen::Vector3d::UnitX();
            // The ends of the faces that intersect: of a the farthest behind, of b the farthest ahead.
            double least_of_a = std::numeric_limits<double>::infinity();
            double most_of_b = -std::numeric_limits<double>::infinity();
            for (const Intersection& i : intersections)
                for (int k = 0; k < 3; ++k) {
                    least_of_a = std::min(least_of_a, a.begin(a.F()(i.a, k)).dot(along));
                    most_of_b = std::max(most_of_b, b.begin(b.F()(i.b, k)).dot(along));
                }
            const double push = std::max(most_of_b - least_of_a, 0.0) + room;
            part(a.body(), b.body(), push * along);
        }
    }
    forget_contacts();
    if (!found.empty())
        throw std::invalid_argument(
            fmt::format("bodies cannot be moved apart: {}", intersection_text(found, barrier().surfaces())));
    if (stuck >= 0)
        throw std::invalid_argument(fmt::format("body {} cannot be moved out of obstacles", stuck));
    std::erase_if(moves, [](const StartMove& m) { return m.by.isZero(0); });
    return moves;
}

/// The nearest points of every two bodies that are nearer than the least distance of steps without
/// intersections, without intersecting.
std::vector<Contact> World::too_near() {
    if (!config_.contact.intersection_free) return {};
    std::map<std::pair<int, int>, Contact> nearest;
    barrier().move(nodes_now(), nodes_now(), 0);
    for (const Contact& contact : barrier().contacts(0)) {
        const int a = contact.a.body, b = contact.b.body;
        if (b < 0 || a == b || contact.gap > 2 * barrier().floor()) continue;
        const auto [known, is_new] = nearest.try_emplace(std::minmax(a, b), contact);
        if (!is_new && contact.gap < known->second.gap) known->second = contact;
    }
    std::vector<Contact> contacts;
    for (const auto& [bodies, contact] : nearest) contacts.push_back(contact);
    return contacts;
}

/// The way by which a body leaves an obstacle, to `room` metres from it; zero if no vertex is in it, nor
/// nearer than the least distance of steps without intersections.
Eigen::Vector3d World::way_out(const Body& body, const Obstacle& obstacle, double room) {
    const double least = config_.contact.intersection_free ? 2 * barrier().floor() : 0;
    SurfaceDistance deepest{std::numeric_limits<double>::infinity(), Eigen::Vector3d::Zero()};
    const Nodes x = embedded(body.surface.W(), body.state.x);
    for (Eigen::Index v = 0; v < x.rows(); ++v)
        if (const auto at = signed_distance(obstacle, x.row(v), time_, least);
            at && at->distance < deepest.distance)
            deepest = *at;
    return deepest.distance <= least ? Eigen::Vector3d((room - deepest.distance) * deepest.normal)
                                     : Eigen::Vector3d::Zero();
}

}  // namespace nbd
