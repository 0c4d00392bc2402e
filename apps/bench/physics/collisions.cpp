// Two free bodies that hit each other.
#include <Eigen/Geometry>
#include <algorithm>
#include <stdexcept>

#include "apps/bench/physics/physics_check.hpp"
#include "apps/bench/physics/physics_world.hpp"

namespace nbd {
namespace {

struct Collision {
    double momentum_error = 0;  // of the sum, relative to the sum of |p| of the bodies
    double angular_error = 0;   // of the sum, relative to the change of the first body
};

/// Two cubes meet off their centres, so that both begin to turn.
Collision collide(const PhysicsCase& c) {
    const Material material = plain_material(c);
    const double sound = speed_of_sound(c);
    // A twentieth of the speed of sound, unless a step then leads through a good part of the body.
    const double speed = std::min({0.05 * sound, 10.0, 0.1 * c.size / c.dt});
    const Solid solid(cube(c), material);
    const Eigen::Matrix3d R = Eigen::AngleAxisd(0.3, Eigen::Vector3d(1, 2, 0.5).normalized()).matrix();
    World world =
        world_of(c, weightless(),
                 {solid.at({0, 0, 0}, {speed, 0, 0}),
                  solid.at(c.size * Eigen::Vector3d(1.45, 0.45, 0.2), {-speed, 0, 0}, {0, 0, 0}, R)});
    const Eigen::Vector3d p0[2]{momentum(world, 0), momentum(world, 1)},
        l0[2]{angular_momentum(world, 0), angular_momentum(world, 1)};
    // Until half a size of way after the first contact, the longest that an impact takes at this speed.
    bool has_met = false;
    double after = 0;
    const int most = 3 * c.size / (speed * c.dt);
    for (int s = 0; s < most && after < 0.5 * c.size; ++s) {
        advance(world, c.dt);
        has_met = has_met || contact_force(world, 0).norm() > 0;
        if (has_met) after += speed * c.dt;
    }
    const Eigen::Vector3d p1[2]{momentum(world, 0), momentum(world, 1)},
        l1[2]{angular_momentum(world, 0), angular_momentum(world, 1)};
    if (!has_met || (p1[0] - p0[0]).norm() < 0.1 * p0[0].norm())
        throw std::runtime_error("the bodies pass each other without a push");
    return {.momentum_error = (p1[0] + p1[1] - p0[0] - p0[1]).norm() / (p0[0].norm() + p0[1].norm()),
            .angular_error = (l1[0] + l1[1] - l0[0] - l0[1]).norm() / (l1[0] - l0[0]).norm()};
}

}  // namespace

std::vector<PhysicsCheck> collision_checks() {
    const std::vector<PhysicsCase> cases = all_cases({.sizes = three_sizes}, 13);
    return {{"collision_momentum", "The sum of the momenta of two cubes that collide stays.",
             "lost, share of the sum of momenta", 1e-9, cases,
             [](const PhysicsCase& c) { return zero_outcome(collide(c).momentum_error); }},
            {"collision_spin", "The sum of their angular momenta stays, too.",
             "lost, share of what one body gains", 1e-3, cases,
             [](const PhysicsCase& c) { return zero_outcome(collide(c).angular_error); }}};
}

}  // namespace nbd
