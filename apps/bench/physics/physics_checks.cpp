#include <iterator>

#include "apps/bench/physics/physics_check.hpp"

namespace nbd {

std::vector<PhysicsCheck> physics_checks() {
    std::vector<PhysicsCheck> all;
    for (const auto group : {free_motion_checks, collision_checks, friction_checks, rest_checks,
                             impact_checks, ringing_checks, stiffness_checks, told_checks, thread_checks}) {
        std::vector<PhysicsCheck> checks = group();
        all.insert(all.end(), std::make_move_iterator(checks.begin()), std::make_move_iterator(checks.end()));
    }
    return all;
}

}  // namespace nbd
