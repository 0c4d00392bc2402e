#include "sim/contact/obstacle_contact.hpp"

#include <algorithm>

namespace nbd {
namespace {

/// Whether a ball is certainly farther than `reach` from the obstacle: its distance changes by at most a
/// metre a metre.
bool out_of_reach(const Obstacle& obstacle, const ContactSurface::Ball& ball, double time, double reach) {
    const double most = reach + ball.radius;
    const auto hit = signed_distance(obstacle, ball.centre, time, most);
    return !hit || hit->distance > most;
}

}  // namespace

void find_obstacle_contacts(int body, const ContactSurface& surface, const Obstacle& obstacle, double time,
                            double dt, double reach, std::vector<Contact>& contacts) {
    if (out_of_reach(obstacle, surface.ball(), time, reach)) return;
    const Eigen::Vector3d velocity = mean_velocity(obstacle, time, dt);
    const std::size_t first = contacts.size();
    for (int patch = 0; patch < surface.patches().count(); ++patch) {
        const auto vertices = surface.patches().vertices[patch];
        if (vertices.empty() || out_of_reach(obstacle, surface.patch_ball(patch), time, reach)) continue;
        for (const int v : vertices) {
            const auto hit = signed_distance(obstacle, surface.x(v), time, reach);
            if (!hit || hit->distance > reach) continue;
            contacts.push_back({.a = {.body = body, .count = 1, .vertices = {v}, .weights = {1}},
                                .normal = hit->normal,
                                .wall_velocity = velocity,
                                .gap = hit->distance,
                                .area = surface.rest_areas()[v],
                                .friction = obstacle.friction});
        }
    }
    std::sort(contacts.begin() + static_cast<std::ptrdiff_t>(first), contacts.end(),
              [](const Contact& s, const Contact& t) { return s.a.vertices[0] < t.a.vertices[0]; });
}

}  // namespace nbd
