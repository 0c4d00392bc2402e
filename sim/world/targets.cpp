// What is told from step to step: where obstacles, grips, motors, tensions and loads go in the next one.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "sim/world/world.hpp"

namespace nbd {

void World::move_obstacle(int obstacle, Keyframe place) {
    if (obstacle < 0 || obstacle >= std::ssize(obstacles_))
        throw std::invalid_argument(
            fmt::format("world: obstacle {} is not one of its {}", obstacle, obstacles_.size()));
    place.time = 0;
    check_motion({.keyframes = {place}});
    next_.obstacles[obstacle] = place;
    Obstacle& moved = obstacles_[obstacle];
    if (!moved.stands()) return;
    // What is held may touch an obstacle that stands for ever; now it is known that this one does not. The
    // step sets when it is there.
    moved.motion.go_to(place, time_, time_ + 1);
    forget_parts();
}

void World::move_grip(int body, int grip, Keyframe place) {
    Body& moved = at(body);
    if (grip < 0 || grip >= std::ssize(moved.grips))
        throw std::invalid_argument(
            fmt::format("world: grip {} is not one of the {} of {}", grip, moved.grips.size(), moved.name));
    place.time = 0;
    check_motion({.keyframes = {place}});
    if (moved.elastic->is_rigid() && place.scale != 1)
        throw std::invalid_argument("world: a rigid body cannot be scaled");
    next_.grips[{body, grip}] = place;
    Motion& motion = moved.grips[grip].motion;
    if (!motion.stays()) return;
    motion.go_to(place, time_, time_ + 1);  // as of an obstacle
    forget_parts();
}

void World::set_joint(int joint, double value) {
    if (joint < 0 || joint >= joint_count())
        throw std::invalid_argument(
            fmt::format("world: joint {} is not one of its {}", joint, joint_count()));
    JointBonds& bonds = joints_[joint];
    const std::string& name = bonds.joint().name;
    if (!told_of(joint))
        throw std::invalid_argument(
            fmt::format("world: joint \"{}\" has no motor, winch or given tension", name));
    if (!std::isfinite(value)) throw std::invalid_argument("world: the value of a joint is not finite");
    if (const auto* cord = std::get_if<CordJoint>(&bonds.joint().kind)) {
        const bool is_winch = !cord->winch.empty() || tendon_of(joint) >= 0;
        if (value < 0 || (is_winch && value == 0))
            throw std::invalid_argument(fmt::format("world: the {} of joint \"{}\" is {}, but must be {} 0",
                                                    is_winch ? "length" : "tension", name, value,
                                                    is_winch ? ">" : ">="));
    }
    next_.joints[joint] = value;
}

/// Of a part of a tendon, the winch of that.
Keyed<double>* World::told_of(int joint) {
    const int tendon = tendon_of(joint);
    return tendon >= 0 ? &tendons_[tendon].winch : joints_[joint].told();
}

Keyed<double>* World::factor_of(int body, int load) {
    for (LoadForces& one : at(body).loads)
        if (one.load().number == load) return &one.factor();
    for (ClosedGas& gas : at(body).gases)
        if (gas.load == load) return &gas.amount;
    return nullptr;
}

Wind* World::wind_of(int body, int load) {
    for (Wind& wind : at(body).winds)
        if (wind.load().number == load) return &wind;
    return nullptr;
}

void World::set_load(int body, int load, double factor) {
    if (wind_of(body, load))
        throw std::invalid_argument(
            fmt::format("world: load {} of {} is a wind, which has a velocity", load, at(body).name));
    if (!factor_of(body, load))
        throw std::invalid_argument(fmt::format("world: load {} of {} is not there", load, at(body).name));
    if (!std::isfinite(factor)) throw std::invalid_argument("world: the factor of a load is not finite");
    const bool is_gas = std::ranges::find(at(body).gases, load, &ClosedGas::load) != at(body).gases.end();
    const bool is_muscle = std::ranges::any_of(at(body).loads, [&](const LoadForces& one) {
        return one.load().number == load && one.load().kind == LoadKind::muscle;
    });
    if ((is_gas || is_muscle) && factor < 0)
        throw std::invalid_argument(fmt::format("world: the factor of a {} is {}, but must be >= 0",
                                                is_gas ? "gas" : "muscle", factor));
    next_.factors[{body, load}] = factor;
}

void World::set_wind(int body, int load, const Eigen::Vector3d& velocity) {
    if (!wind_of(body, load))
        throw std::invalid_argument(fmt::format("world: load {} of {} is no wind", load, at(body).name));
    if (!velocity.allFinite()) throw std::invalid_argument("world: the velocity of a wind is not finite");
    next_.winds[{body, load}] = velocity;
}

/// Lets all of it go to its targets in a step of length dt. A step that is begun anew does the same again.
void World::go_to_targets(double dt) {
    const double end = time_ + dt;
    for (const auto& [obstacle, place] : next_.obstacles) {
        Motion& motion = obstacles_[obstacle].motion;
        motion.go_to(place, time_, end);
        barrier().motion_of(obstacle) = motion;
    }
    for (const auto& [grip, place] : next_.grips)
        at(grip.first).grips[grip.second].motion.go_to(place, time_, end);
    for (const auto& [joint, value] : next_.joints) told_of(joint)->go_to(value, time_, end, 0);
    for (const auto& [load, factor] : next_.factors)
        factor_of(load.first, load.second)->go_to(factor, time_, end, load_share(time_));
    for (const auto& [load, velocity] : next_.winds) {
        Wind& wind = *wind_of(load.first, load.second);
        wind.load().air.keys.go_to(velocity, time_, end, wind.air_at(time_));
    }
}

}  // namespace nbd
