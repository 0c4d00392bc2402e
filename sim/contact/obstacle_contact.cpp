#include "sim/contact/obstacle_contact.hpp"

namespace nbd {

void find_obstacle_contacts(int body, const ContactSurface& surface, const Obstacle& obstacle, double time,
                            double dt, double reach, std::vector<Contact>& contacts) {
    const Eigen::Vector3d velocity = mean_velocity(obstacle, time, dt);
    for (int v = 0; v < surface.vertex_count(); ++v) {
        const auto hit = signed_distance(obstacle, surface.x().row(v).transpose(), time, reach);
        if (!hit || hit->distance > reach) continue;
        contacts.push_back({.a = {.body = body, .count = 1, .vertices = {v}, .weights = {1}},
                            .normal = hit->normal,
                            .wall_velocity = velocity,
                            .gap = hit->distance,
                            .area = surface.rest_areas()[v],
                            .friction = obstacle.friction});
    }
}

}  // namespace nbd
