// Approaches to spheres that are too fast for a step, which the barrier does not see.
#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <optional>
#include <variant>

#include "sim/world/world.hpp"

namespace nbd {
namespace {

double longest_row(const Nodes& rows) { return rows.rowwise().norm().maxCoeff(); }

/// How near a point at p comes to the origin on its way to p + way; infinite if it only goes away.
double least_distance(const Eigen::Vector3d& p, const Eigen::Vector3d& way) {
    const double nearer = -p.dot(way);
    if (!(nearer > 0)) return std::numeric_limits<double>::infinity();
    return (p + std::min(nearer / way.squaredNorm(), 1.0) * way).norm();
}

}  // namespace

/// How far the nodes go in dt, [N, 3] metres: as fast as they are, and those that are held as they are told.
Nodes World::foreseen_motion(const Body& body, double dt) const {
    Nodes way = dt * body.state.v;
    const PrescribedNodes given = prescribed(body, dt);
    for (std::size_t k = 0; k < given.nodes.size(); ++k) {
        const int node = given.nodes[k];
        way.row(node) = body.start.x.row(node) + dt * given.v.row(k) - body.state.x.row(node);
    }
    return way;
}

/// Only vertices meet a sphere, and the iterates of a step are no motion: a vertex may come to lie behind a
/// sphere whose centre goes beyond it in one step. Before the step, a vertex in the way of the centre is at
/// least a radius ahead of it. So it is still ahead if the two approach by at most a radius, and no more is
/// allowed.
World::Rejection World::pass_of_ball(double dt) const {
    for (int b = 0; b < body_count(); ++b) {
        const Body& body = at(b);
        std::optional<Nodes> foreseen;  // once for all spheres
        for (std::size_t o = 0; o < obstacles_.size(); ++o) {
            const BallShape* ball = std::get_if<BallShape>(&obstacles_[o].shape);
            if (!ball || !pairs_.meet(b, party_of_obstacle(o))) continue;
            if (!foreseen) foreseen = foreseen_motion(body, dt);
            const Motion& motion = obstacles_[o].motion;
            const Placing now = motion.at(time_), then = motion.at(time_ + dt);
            const Eigen::Vector3d centre = now(ball->centre);
            const Eigen::RowVector3d moves = (then(ball->centre) - centre).transpose();
            const double radius = now.scale * ball->radius,
                         growth = std::max(then.scale - now.scale, 0.0) * ball->radius;
            const Nodes nodes = foreseen->rowwise() - moves;
            if (longest_row(nodes) + growth <= radius) continue;
            const Nodes x = embedded(body.shape->W, body.state.x), way = embedded(body.shape->W, nodes);
            double approach = 0;
            for (Eigen::Index v = 0; v < x.rows(); ++v)
                if (least_distance(x.row(v).transpose() - centre, way.row(v).transpose()) <
                    radius + growth + thickness())
                    approach = std::max(approach, way.row(v).norm() + growth);
            if (approach > radius)
                return {
                    .reason = fmt::format("body {} and the sphere obstacles[{}] may approach each other by "
                                          "{:.2g} m in a step, allowed: its radius, {:.2g}",
                                          b, o, approach, radius),
                    .trouble = StepTrouble::approach};
        }
    }
    return {};
}

}  // namespace nbd
