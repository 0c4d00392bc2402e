#include "sim/world/targets.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <variant>

namespace nbd {
namespace {

/// Of a part of a tendon, the winch of that.
Keyed<double>* told_of(WorldState& world, int joint) {
    const int tendon = world.tendon_of(joint);
    return tendon >= 0 ? &world.tendons[tendon].winch : world.joints[joint].told();
}

Keyed<double>* factor_of(SteppedBody& body, int load) {
    for (LoadForces& one : body.loads)
        if (one.load().number == load) return &one.factor();
    for (ClosedGas& gas : body.gases)
        if (gas.load == load) return &gas.amount;
    return nullptr;
}

Wind* wind_of(SteppedBody& body, int load) {
    for (Wind& wind : body.winds)
        if (wind.load().number == load) return &wind;
    return nullptr;
}

}  // namespace

bool Targets::move_obstacle(WorldState& world, int obstacle, Keyframe place) {
    if (obstacle < 0 || obstacle >= std::ssize(world.obstacles))
        throw std::invalid_argument(
            fmt::format("world: obstacle {} is not one of its {}", obstacle, world.obstacles.size()));
    place.time = 0;
    check_motion({.keyframes = {place}});
    obstacles_[obstacle] = place;
    Obstacle& moved = world.obstacles[obstacle];
    if (!moved.stands()) return false;
    // What is held may touch an obstacle that stands for ever; now it is known that this one does not. The
    // step sets when it is there.
    obstacles_before_.emplace(obstacle, moved.motion);
    moved.motion.go_to(place, world.time, world.time + 1);
    return true;
}

bool Targets::move_grip(WorldState& world, int body, int grip, Keyframe place) {
    SteppedBody& moved = world.at(body);
    if (grip < 0 || grip >= std::ssize(moved.grips))
        throw std::invalid_argument(
            fmt::format("world: grip {} is not one of the {} of {}", grip, moved.grips.size(), moved.name));
    place.time = 0;
    check_motion({.keyframes = {place}});
    if (moved.elastic->is_rigid() && place.scale != 1)
        throw std::invalid_argument("world: a rigid body cannot be scaled");
    grips_[{body, grip}] = place;
    Motion& motion = moved.grips[grip].motion;
    if (!motion.stays()) return false;
    grips_before_.emplace(std::pair(body, grip), motion);
    motion.go_to(place, world.time, world.time + 1);  // as of an obstacle
    return true;
}

void Targets::set_joint(WorldState& world, int joint, double value) {
    if (joint < 0 || joint >= std::ssize(world.joints))
        throw std::invalid_argument(
            fmt::format("world: joint {} is not one of its {}", joint, std::ssize(world.joints)));
    JointBonds& bonds = world.joints[joint];
    const std::string& name = bonds.joint().name;
    if (!told_of(world, joint))
        throw std::invalid_argument(
            fmt::format("world: joint \"{}\" has no motor, winch or given tension", name));
    if (!std::isfinite(value)) throw std::invalid_argument("world: the value of a joint is not finite");
    if (const auto* cord = std::get_if<CordJoint>(&bonds.joint().kind)) {
        const bool is_winch = !cord->winch.empty() || world.tendon_of(joint) >= 0;
        if (value < 0 || (is_winch && value == 0))
            throw std::invalid_argument(fmt::format("world: the {} of joint \"{}\" is {}, but must be {} 0",
                                                    is_winch ? "length" : "tension", name, value,
                                                    is_winch ? ">" : ">="));
    }
    joints_[joint] = value;
}

void Targets::set_load(WorldState& world, int body, int load, double factor) {
    if (wind_of(world.at(body), load))
        throw std::invalid_argument(
            fmt::format("world: load {} of {} is a wind, which has a velocity", load, world.at(body).name));
    if (!factor_of(world.at(body), load))
        throw std::invalid_argument(
            fmt::format("world: load {} of {} is not there", load, world.at(body).name));
    if (!std::isfinite(factor)) throw std::invalid_argument("world: the factor of a load is not finite");
    const bool is_gas =
        std::ranges::find(world.at(body).gases, load, &ClosedGas::load) != world.at(body).gases.end();
    const bool is_muscle = std::ranges::any_of(world.at(body).loads, [&](const LoadForces& one) {
        return one.load().number == load && one.load().kind == LoadKind::muscle;
    });
    if ((is_gas || is_muscle) && factor < 0)
        throw std::invalid_argument(fmt::format("world: the factor of a {} is {}, but must be >= 0",
                                                is_gas ? "gas" : "muscle", factor));
    factors_[{body, load}] = factor;
}

void Targets::set_wind(WorldState& world, int body, int load, const Eigen::Vector3d& velocity) {
    if (!wind_of(world.at(body), load))
        throw std::invalid_argument(
            fmt::format("world: load {} of {} is no wind", load, world.at(body).name));
    if (!velocity.allFinite()) throw std::invalid_argument("world: the velocity of a wind is not finite");
    winds_[{body, load}] = velocity;
}

bool Targets::forget(WorldState& world) {
    for (auto& [obstacle, motion] : obstacles_before_) world.obstacles[obstacle].motion = std::move(motion);
    for (auto& [grip, motion] : grips_before_)
        world.at(grip.first).grips[grip.second].motion = std::move(motion);
    for (auto& [joint, keys] : joints_before_) *told_of(world, joint) = std::move(keys);
    for (auto& [load, keys] : factors_before_)
        *factor_of(world.at(load.first), load.second) = std::move(keys);
    for (auto& [load, keys] : winds_before_)
        wind_of(world.at(load.first), load.second)->load().air.keys = std::move(keys);
    const bool move = !obstacles_before_.empty() || !grips_before_.empty();
    clear();
    return move;
}

void Targets::go(WorldState& world, Barrier& barrier, double dt) {
    const double end = world.time + dt;
    for (const auto& [obstacle, place] : obstacles_) {
        Motion& motion = world.obstacles[obstacle].motion;
        obstacles_before_.emplace(obstacle, motion);
        motion.go_to(place, world.time, end);
        barrier.motion_of(obstacle) = motion;
    }
    for (const auto& [grip, place] : grips_) {
        Motion& motion = world.at(grip.first).grips[grip.second].motion;
        grips_before_.emplace(grip, motion);
        motion.go_to(place, world.time, end);
    }
    for (const auto& [joint, value] : joints_) {
        Keyed<double>& keys = *told_of(world, joint);
        joints_before_.emplace(joint, keys);
        keys.go_to(value, world.time, end, 0);
    }
    for (const auto& [load, factor] : factors_) {
        SteppedBody& body = world.at(load.first);
        const bool is_gas = std::ranges::find(body.gases, load.second, &ClosedGas::load) != body.gases.end();
        Keyed<double>& keys = *factor_of(body, load.second);
        factors_before_.emplace(load, keys);
        keys.go_to(factor, world.time, end, is_gas ? 1 : world.load_share(world.time));
    }
    for (const auto& [load, velocity] : winds_) {
        Wind& wind = *wind_of(world.at(load.first), load.second);
        winds_before_.emplace(load, wind.load().air.keys);
        wind.load().air.keys.go_to(velocity, world.time, end, wind.air_at(world.time));
    }
}

}  // namespace nbd
