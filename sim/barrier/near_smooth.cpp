// The vertices of bodies that come near planes and balls.
#include <Eigen/Geometry>
#include <algorithm>
#include <vector>

#include "meshing/parallel/parallel_for.hpp"
#include "sim/barrier/barrier.hpp"

namespace nbd {

/// Whether vertices that hang on these nodes may come near a plane or ball in the motion.
bool Barrier::may_come_near(const MovingSurface& surface, std::span<const int> nodes,
                            const Wall& wall) const {
    Eigen::AlignedBox3d box;
    double most = 0;
    for (const int node : nodes) {
        const Eigen::Vector3d begin = surface.begin_points().row(node), end = surface.end_points().row(node);
        box.extend(begin);
        most = std::max(most, wall.smooth->relative_way(begin, end, progress_));
    }
    return wall.smooth->distance(box.center(), progress_).distance <=
           reach_ + most + box.diagonal().norm() / 2;
}

void Barrier::find_near_smooth() {
    near_smooth_.clear();
    std::vector<std::vector<NearSmooth>> found(bodies_.size());
    for (std::size_t w = 0; w < walls_.size(); ++w) {
        const Wall& wall = walls_[w];
        if (!wall.smooth) continue;
        const auto look_at_body = [&](int b) {
            found[b].clear();
            if (!rules_.meet(b, party_of_obstacle(w))) return;
            const MovingSurface& surface = surfaces_[b];
            const auto look_at = [&](int v) {
                const NearSmooth near{b, v, static_cast<int>(w)};
                const double way = wall.smooth->relative_way(surface.begin(v), surface.end(v), progress_);
                if (distance(near, 0).distance <= reach_ + way) found[b].push_back(near);
            };
            if (!surface.hangs_on_nodes()) {
                for (int v = 0; v < surface.rest().rows(); ++v) look_at(v);
                return;
            }
            const ContactShape& shape = surface.shape();
            const int patches = shape.patches.count(), width = ContactPatches::width;
            for (int block = 0; block * width < patches; ++block) {
                if (!may_come_near(surface, shape.patches.of_block[block], wall)) continue;
                for (int patch = block * width; patch < std::min((block + 1) * width, patches); ++patch)
                    if (may_come_near(surface, shape.patches.nodes[patch], wall))
                        for (const int v : shape.patches.vertices[patch]) look_at(v);
            }
        };
        parallel_for(std::ssize(bodies_), look_at_body, 1);
        for (const std::vector<NearSmooth>& some : found)
            near_smooth_.insert(near_smooth_.end(), some.begin(), some.end());
    }
}

SurfaceDistance Barrier::distance(const NearSmooth& near, double share) const {
    SurfaceDistance found = walls_[near.wall].smooth->distance(surfaces_[near.body].at(near.vertex, share),
                                                               progress_ + share * (1 - progress_));
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
    const double floor = floor_share * reach_, room = room_at(distance(near, 0).distance, floor, reach_);
    const MovingSurface& surface = surfaces_[near.body];
    return walls_[near.wall].smooth->limit(surface.at(near.vertex, 0), surface.at(near.vertex, 1), progress_,
                                           floor + left_share * room - farther(near), tolerance_share * room);
}

BarrierLaw Barrier::law(const NearSmooth& near) const {
    return law(bodies_[near.body].young, surfaces_[near.body].rest_areas()[near.vertex], reach_);
}

Contact Barrier::contact(const NearSmooth& near, double share) const {
    const Wall& wall = walls_[near.wall];
    const SurfaceDistance hit = distance(near, share);
    Contact contact{.a = {.body = near.body, .count = 1, .vertices = {near.vertex}, .weights = {1}},
                    .normal = hit.normal,
                    .gap = hit.distance,
                    .obstacle = near.wall};
    contact.friction = friction(contact, wall.obstacle.friction);
    if (wall.moves)
        contact.wall_velocity = wall.smooth->way_of(surfaces_[near.body].at(near.vertex, share),
                                                    progress_ + share * (1 - progress_)) /
                                dt_;
    return contact;
}

}  // namespace nbd
