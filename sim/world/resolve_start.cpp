// Moves bodies apart before the first step without intersections.
#include <fmt/format.h>

#include <limits>
#include <map>
#include <stdexcept>
#include <utility>
#include <variant>

#include "sim/world/world.hpp"

namespace nbd {
namespace {

constexpr int max_rounds = 64;

Eigen::Vector3d middle(const Nodes& x) {
    return (x.colwise().minCoeff() + x.colwise().maxCoeff()).transpose() / 2;
}

/// The faces of two surfaces that intersect each other, as ranges along a direction.
struct Overlap {
    double least_a = std::numeric_limits<double>::infinity(), most_b = -least_a;
};

}  // namespace

std::vector<StartMove> World::resolve_start() {
    std::vector<StartMove> moves;
    for (int b = 0; b < body_count(); ++b) moves.push_back({b, Eigen::Vector3d::Zero()});
    const auto can_move = [&](int body) { return body >= 0 && at(body).grips.empty(); };
    const auto move = [&](int body, const Eigen::Vector3d& by) {
        at(body).state.x.rowwise() += by.transpose();
        at(body).measured = false;
        moves[static_cast<std::size_t>(body)].by += by;
    };
    const double room = 2 * thickness();
    std::vector<Intersection> found;
    for (int round = 0; round < max_rounds; ++round) {
        bool clear = true;
        for (int b = 0; b < body_count(); ++b)
            for (const Obstacle& obstacle : obstacles_)
                if (const Eigen::Vector3d by = way_out(at(b), obstacle, room); by.norm() > 0 && can_move(b)) {
                    move(b, by);
                    clear = false;
                }
        found = intersecting_faces();
        if (found.empty() && clear) break;
        const std::vector<MovingSurface>& surfaces = barrier().surfaces();
        std::map<std::pair<int, int>, std::vector<Intersection>> by_pair;
        for (const Intersection& i : found) by_pair[{i.surface_a, i.surface_b}].push_back(i);
        for (const auto& [pair, intersections] : by_pair) {
            const MovingSurface &a = surfaces[static_cast<std::size_t>(pair.first)],
                                &b = surfaces[static_cast<std::size_t>(pair.second)];
            if (pair.first == pair.second || !(can_move(a.body()) || can_move(b.body()))) continue;
            Eigen::Vector3d along = middle(a.begin()) - middle(b.begin());
            along = along.norm() > 0 ? along.normalized() : Eigen::Vector3d::UnitX();
            Overlap overlap;
            for (const Intersection& i : intersections)
                for (int k = 0; k < 3; ++k) {
                    overlap.least_a = std::min(overlap.least_a, a.begin().row(a.F()(i.a, k)).dot(along));
                    overlap.most_b = std::max(overlap.most_b, b.begin().row(b.F()(i.b, k)).dot(along));
                }
            const double push = std::max(overlap.most_b - overlap.least_a, 0.0) + room;
            const double share = can_move(a.body()) && can_move(b.body()) ? 0.5 : 1;
            if (can_move(a.body())) move(a.body(), share * push * along);
            if (can_move(b.body())) move(b.body(), -share * push * along);
        }
    }
    forget_contacts();
    if (!found.empty())
        throw std::invalid_argument(
            fmt::format("bodies cannot be moved apart: {}", intersection_text(found, barrier().surfaces())));
    std::erase_if(moves, [](const StartMove& m) { return m.by.isZero(0); });
    return moves;
}

/// The way by which a body leaves a plane or a ball, `room` metres from it; zero where it is out, and for
/// meshes.
Eigen::Vector3d World::way_out(const Body& body, const Obstacle& obstacle, double room) const {
    if (std::holds_alternative<std::shared_ptr<const StaticSurface>>(obstacle.shape))
        return Eigen::Vector3d::Zero();
    SurfaceDistance deepest{std::numeric_limits<double>::infinity(), Eigen::Vector3d::Zero()};
    const Nodes x = embedded(body.surface.W(), body.state.x);
    for (Eigen::Index v = 0; v < x.rows(); ++v)
        if (const auto at =
                signed_distance(obstacle, x.row(v), time_, std::numeric_limits<double>::infinity());
            at && at->distance < deepest.distance)
            deepest = *at;
    return deepest.distance < room / 2 ? Eigen::Vector3d((room - deepest.distance) * deepest.normal)
                                       : Eigen::Vector3d::Zero();
}

}  // namespace nbd
