// The vertices of bodies that come near planes and balls.
#include <algorithm>
#include <cmath>
#include <limits>
#include <variant>

#include "sim/barrier/barrier.hpp"

namespace nbd {
namespace {

/// Share of the motion from p to q, relative to the centre of a ball, after which the point is `radius` from
/// the centre; at least 1 if it is not in the motion.
double time_to_ball(const Eigen::Vector3d& p, const Eigen::Vector3d& q, double radius) {
    const Eigen::Vector3d r = q - p;
    const double a = r.squaredNorm(), b = p.dot(r), c = p.squaredNorm() - radius * radius;
    const double discriminant = b * b - a * c;
    if (b >= 0 || discriminant <= 0) return 1;
    return c / (std::sqrt(discriminant) - b);
}

}  // namespace

/// Whether vertices that hang on these nodes may come near a plane or ball in the motion.
bool Barrier::may_come_near(const MovingSurface& surface, std::span<const int> nodes,
                            const Wall& wall) const {
    Eigen::AlignedBox3d box;
    double most = 0;
    for (const int node : nodes) {
        const Eigen::Vector3d begin = surface.begin_points().row(node), end = surface.end_points().row(node);
        box.extend(begin - wall.begin);
        most = std::max(most, (end - wall.end - begin + wall.begin).squaredNorm());
    }
    constexpr double all = std::numeric_limits<double>::infinity();
    const double distance = signed_distance(wall.still, box.center(), 0, all)->distance;
    return distance <= reach_ + std::sqrt(most) + box.diagonal().norm() / 2;
}

void Barrier::find_near_smooth() {
    near_smooth_.clear();
    for (std::size_t w = 0; w < walls_.size(); ++w) {
        const Wall& wall = walls_[w];
        if (wall.surface >= 0) continue;
        const Eigen::Vector3d moved = wall.end - wall.begin;
        for (int b = 0; b < std::ssize(bodies_); ++b) {
            if (!rules_.meet(b, party_of_obstacle(w))) continue;
            const MovingSurface& surface = surfaces_[b];
            const auto look_at = [&](int v) {
                const NearSmooth near{b, v, static_cast<int>(w)};
                const Eigen::Vector3d motion = (surface.end(v) - surface.begin(v)).transpose() - moved;
                if (distance(near, 0).distance <= reach_ + motion.norm()) near_smooth_.push_back(near);
            };
            if (!surface.hangs_on_nodes()) {
                for (int v = 0; v < surface.rest().rows(); ++v) look_at(v);
                continue;
            }
            const ContactShape& shape = surface.shape();
            const int patches = shape.patches.count(), width = ContactPatches::width;
            for (int block = 0; block * width < patches; ++block) {
                if (!may_come_near(surface, shape.patches.of_block[block], wall)) continue;
                for (int patch = block * width; patch < std::min((block + 1) * width, patches); ++patch)
                    if (may_come_near(surface, shape.patches.nodes[patch], wall))
                        for (const int v : shape.patches.vertices[patch]) look_at(v);
            }
        }
    }
}

SurfaceDistance Barrier::distance(const NearSmooth& near, double share) const {
    const Wall& wall = walls_[near.wall];
    const Eigen::Vector3d p =
        surfaces_[near.body].at(near.vertex, share) - (wall.begin + share * (wall.end - wall.begin));
    SurfaceDistance found = *signed_distance(wall.still, p, 0, std::numeric_limits<double>::infinity());
    found.distance += farther(near);
    return found;
}

/// By how much farther from the wall the vertex counts.
double Barrier::farther(const NearSmooth& near) const {
    const auto& held = walls_[near.wall].held_touch;
    if (held.empty()) return 0;
    const auto known = held.find({near.body, near.vertex});
    return known == held.end() ? 0 : known->second;
}

double Barrier::limit(const NearSmooth& near) const {
    const double floor = floor_share * reach_, begin = distance(near, 0).distance;
    const double least = floor + left_share * room_at(begin, floor, reach_);
    const Wall& wall = walls_[near.wall];
    if (const auto* ball = std::get_if<BallShape>(&wall.obstacle.shape)) {
        const MovingSurface& surface = surfaces_[near.body];
        return std::min(time_to_ball(surface.at(near.vertex, 0) - wall.begin - ball->centre,
                                     surface.at(near.vertex, 1) - wall.end - ball->centre,
                                     ball->radius + least - farther(near)),
                        1.0);
    }
    const double end = distance(near, 1).distance;
    return end >= least ? 1 : std::max(begin - least, 0.0) / (begin - end);
}

BarrierLaw Barrier::law(const NearSmooth& near) const {
    return law(bodies_[near.body].young, surfaces_[near.body].rest_areas()[near.vertex], reach_);
}

Contact Barrier::contact(const NearSmooth& near, double share) const {
    const Wall& wall = walls_[near.wall];
    const SurfaceDistance hit = distance(near, share);
    return {.a = {.body = near.body, .count = 1, .vertices = {near.vertex}, .weights = {1}},
            .normal = hit.normal,
            .wall_velocity = wall.velocity,
            .gap = hit.distance,
            .friction = rules_.friction(near.body, party_of_obstacle(near.wall), wall.obstacle.friction),
            .obstacle = near.wall};
}

}  // namespace nbd
