// Moves bodies apart before the first step.
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <limits>
#include <map>
#include <stdexcept>
#include <tuple>
#include <utility>

#include "collision/base/stop.hpp"
#include "sim/world/world.hpp"

namespace nbd {
namespace {

constexpr int max_rounds = 64;

Eigen::Vector3d middle(const Nodes& x) {
    return (x.colwise().minCoeff() + x.colwise().maxCoeff()).transpose() / 2;
}

Eigen::Vector3d normal(const MovingSurface& surface, int face) {
    const auto x = [&](int k) { return Eigen::Vector3d(surface.begin(surface.F()(face, k))); };
    return (x(1) - x(0)).cross(x(2) - x(0)).normalized();
}

/// The shortest way by which the faces of a that intersect b leave those of b, and `room` metres more: along
/// the line of the middles, or a normal of one of these faces.
Eigen::Vector3d way_apart(const MovingSurface& a, const MovingSurface& b,
                          const std::vector<Intersection>& intersections, double room) {
    constexpr std::size_t most_faces = 32;  // whose normals are tried
    const Eigen::Vector3d line = middle(a.begin_points()) - middle(b.begin_points());
    std::vector<Eigen::Vector3d> directions{line.norm() > 0 ? line.normalized() : Eigen::Vector3d::UnitX()};
    const std::size_t stride = (intersections.size() + most_faces - 1) / most_faces;
    for (std::size_t i = 0; i < intersections.size(); i += stride)
        for (const Eigen::Vector3d& n :
             {Eigen::Vector3d(-normal(a, intersections[i].a)), normal(b, intersections[i].b)})
            if (n.allFinite() && n.dot(line) > 0) directions.push_back(n);
    Eigen::Vector3d shortest = Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity());
    for (const Eigen::Vector3d& along : directions) {
        // The ends of the faces that intersect: of a the farthest behind, of b the farthest ahead.
        double least_of_a = std::numeric_limits<double>::infinity();
        double most_of_b = -std::numeric_limits<double>::infinity();
        for (const Intersection& i : intersections)
            for (int k = 0; k < 3; ++k) {
                least_of_a = std::min(least_of_a, a.begin(a.F()(i.a, k)).dot(along));
                most_of_b = std::max(most_of_b, b.begin(b.F()(i.b, k)).dot(along));
            }
        const double push = std::max(most_of_b - least_of_a, 0.0) + room;
        if (push < shortest.norm()) shortest = push * along;
    }
    return shortest;
}

}  // namespace

std::vector<StartMove> World::resolve_start() {
    const WorldSnapshot start = snapshot();
    std::vector<StartMove> moves;
    for (int b = 0; b < state_.body_count(); ++b) moves.push_back({b, Eigen::Vector3d::Zero()});
    const auto can_move = [&](int body) { return can_be_moved(body); };
    const auto move = [&](int body, const Eigen::Vector3d& by) {
        state_.at(body).state.x.rowwise() += by.transpose();
        moves[body].by += by;
    };
    const double room = 2 * state_.thickness();
    std::vector<Intersection> found;
    std::vector<Contact> near;
    int stuck = -1;  // a body that is in an obstacle
    for (int round = 0; round < max_rounds; ++round) {
        if (stop_asked()) {
            reset(start);
            throw StopAsked();
        }
        stuck = -1;
        for (int b = 0; b < state_.body_count(); ++b)
            for (int o = 0; o < std::ssize(state_.obstacles); ++o)
                if (const Eigen::Vector3d by = way_out(b, o, room); !by.isZero(0)) {
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
        near.clear();
        if (found.empty()) {
            near = nearest_within(barrier().least_start());
            std::erase_if(near, [](const Contact& c) { return c.b.body < 0; });  // see way_out()
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
            part(a.body(), b.body(), way_apart(a, b, intersections, room));
        }
    }
    if (!found.empty() || !near.empty() || stuck >= 0) reset(start);
    if (!found.empty())
        throw std::invalid_argument(
            fmt::format("bodies cannot be moved apart: {}", intersection_text(found, barrier().surfaces())));
    if (stuck >= 0)
        throw std::invalid_argument(fmt::format("body {} cannot be moved out of obstacles", stuck));
    if (!near.empty())
        throw std::invalid_argument(fmt::format("bodies {} and {} cannot be moved apart: they stay too near",
                                                near.front().a.body, near.front().b.body));
    std::erase_if(moves, [](const StartMove& m) { return m.by.isZero(0); });
    return moves;
}

std::vector<StartMove> World::part_touching() {
    constexpr double slight = 1e-2;  // of a body's diagonal
    try {
        check_start();
        return part_pressing();
    } catch (const std::invalid_argument&) {  // then they are moved
    }
    const WorldSnapshot start = snapshot();
    try {
        const std::vector<StartMove> moves = resolve_start();
        if (std::ranges::all_of(moves, [&](const StartMove& move) {
                return move.by.norm() <= slight * shape(move.body).rest_diagonal;
            })) {
            check_start();
            return moves;
        }
    } catch (const std::invalid_argument&) {  // check_start() says why
    }
    reset(start);
    return {};
}

/// Moves bodies that press something to where they hardly do.
std::vector<StartMove> World::part_pressing() {
    constexpr double hardly = 0.95;  // of the distance at which they begin to
    const WorldSnapshot start = snapshot();
    std::vector<StartMove> moves;
    for (int b = 0; b < state_.body_count(); ++b) moves.push_back({b, Eigen::Vector3d::Zero()});
    for (int round = 0; round < max_rounds; ++round) {
        stop_if_asked();
        bool is_apart = true;
        for (const Contact& contact : nearest_within(hardly * state_.thickness())) {
            const int a = contact.a.body, b = contact.b.body;
            const bool moves_a = can_be_moved(a), moves_b = can_be_moved(b);
            if (!moves_a && !moves_b) continue;
            is_apart = false;
            const Eigen::Vector3d by =
                (moves_a && moves_b ? 0.5 : 1) * (state_.thickness() - contact.gap) * contact.normal;
            for (const auto& [body, way, can] :
                 {std::tuple(a, by, moves_a), {b, Eigen::Vector3d(-by), moves_b}}) {
                if (!can) continue;
                state_.at(body).state.x.rowwise() += way.transpose();
                moves[body].by += way;
            }
        }
        if (!is_apart) continue;
        std::erase_if(moves, [](const StartMove& move) { return move.by.isZero(0); });
        start_is_checked_ = moves.empty();
        return moves;
    }
    reset(start);
    return {};
}

/// The nearest points of every two bodies, and of bodies and obstacles, that are no farther apart than a
/// distance below the reach of contacts, without intersecting.
std::vector<Contact> World::nearest_within(double distance) {
    std::map<std::pair<int, int>, Contact> nearest;
    barrier().be_exact(true);  // until the next part
    barrier().begin_step(state_.time, 0);
    barrier().look(state_.nodes_now(), state_.nodes_now(), 0);
    for (const Contact& contact : barrier().contacts(0)) {
        const int a = contact.a.body,
                  b = contact.b.body < 0 ? party_of_obstacle(contact.obstacle) : contact.b.body;
        if (a == b || contact.gap > distance) continue;
        const auto [known, is_new] = nearest.try_emplace(std::minmax(a, b), contact);
        if (!is_new && contact.gap < known->second.gap) known->second = contact;
    }
    std::vector<Contact> contacts;
    for (const auto& [bodies, contact] : nearest) contacts.push_back(contact);
    return contacts;
}

bool World::can_be_moved(int body) const {
    return body >= 0 && !state_.is_joined(body) && state_.at(body).grips.empty() &&
           state_.at(body).driven.nodes.empty();
}

/// The way by which a body leaves an obstacle, to `room` metres from it; zero if no vertex is in it, nor too
/// near to start, or the two do not meet.
Eigen::Vector3d World::way_out(int body, int obstacle, double room) {
    if (!state_.pairs.meet(body, party_of_obstacle(obstacle))) return Eigen::Vector3d::Zero();
    const double least = barrier().least_start();
    SurfaceDistance deepest{std::numeric_limits<double>::infinity(), Eigen::Vector3d::Zero()};
    const Nodes x = surface(body);
    const Obstacle now = as_at(state_.obstacles[obstacle], state_.time);
    for (int v = 0; v < x.rows(); ++v)
        if (const auto at = signed_distance(now, x.row(v), state_.time, least);
            at && at->distance < deepest.distance && !barrier().may_touch(body, v, obstacle))
            deepest = *at;
    return deepest.distance <= least ? Eigen::Vector3d((room - deepest.distance) * deepest.normal)
                                     : Eigen::Vector3d::Zero();
}

}  // namespace nbd
