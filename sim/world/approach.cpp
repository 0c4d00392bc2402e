#include "sim/world/approach.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <optional>
#include <variant>

namespace nbd {
namespace {

double longest_row(const Nodes& rows) { return rows.rowwise().norm().maxCoeff(); }

/// How near a point at p comes to the origin on its way to p + way; infinite if it only goes away.
double least_distance(const Eigen::Vector3d& p, const Eigen::Vector3d& way) {
    const double nearer = -p.dot(way);
    if (!(nearer > 0)) return std::numeric_limits<double>::infinity();
    return (p + std::min(nearer / way.squaredNorm(), 1.0) * way).norm();
}

/// How far the nodes go in dt, [N, 3] metres: as fast as they are, and those that are held as they are told.
Nodes foreseen_motion(const WorldState& world, const SteppedBody& body, double dt) {
    Nodes way = dt * body.state.v;
    const PrescribedNodes given = world.prescribed(body, dt);
    for (std::size_t k = 0; k < given.nodes.size(); ++k) {
        const int node = given.nodes[k];
        way.row(node) = body.start.x.row(node) + dt * given.v.row(k) - body.state.x.row(node);
    }
    return way;
}

}  // namespace

Rejection pass_of_ball(const WorldState& world, double dt) {
    for (int b = 0; b < world.body_count(); ++b) {
        const SteppedBody& body = world.at(b);
        std::optional<Nodes> foreseen;  // once for all spheres
        for (std::size_t o = 0; o < world.obstacles.size(); ++o) {
            const BallShape* ball = std::get_if<BallShape>(&world.obstacles[o].shape);
            if (!ball || !world.pairs.meet(b, party_of_obstacle(o))) continue;
            if (!foreseen) foreseen = foreseen_motion(world, body, dt);
            const Motion& motion = world.obstacles[o].motion;
            const Placing now = motion.at(world.time), then = motion.at(world.time + dt);
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
                    radius + growth + world.thickness())
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
