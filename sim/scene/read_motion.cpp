#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <numbers>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "sim/scene/read_parts.hpp"

namespace nbd {
namespace {

constexpr double radians_per_degree = std::numbers::pi / 180;

/// The rates at which a keyframe goes on to the next one; none: by places.
struct Rates {
    std::optional<Eigen::Vector3d> velocity, spin;  // m/s, rad/s
};

/// Reads `velocity` and `angular_velocity` of a keyframe, which then goes on evenly.
Rates read_rates(JsonObject& from, Keyframe& keyframe) {
    Rates rates;
    const Eigen::Vector3d velocity = from.vector("velocity", Eigen::Vector3d::Zero()),
                          spin = from.vector("angular_velocity", Eigen::Vector3d::Zero());
    if (from.has("velocity")) rates.velocity = velocity;
    if (from.has("angular_velocity")) {
        rates.spin = spin;
        constexpr double rounding = 1e-9;
        if (rates.spin->cross(keyframe.rotation).norm() >
            rounding * rates.spin->norm() * keyframe.rotation.norm()) {
            from.problem("angular_velocity",
                         "turns about another axis than the rotation so far; allowed: about the same, or "
                         "keyframes with \"rotate\"");
            rates.spin = Eigen::Vector3d::Zero();
        }
    }
    if (!rates.velocity && !rates.spin) return rates;
    keyframe.to_next = Interpolation::linear;
    if (from.has("interpolation"))
        from.problem("interpolation", "must not be beside a velocity, by which it goes on evenly");
    return rates;
}

/// Moves a keyframe to where the rates of the one before it lead.
void go_by(const Rates& rates, double duration, Keyframe& keyframe) {
    if (rates.velocity) keyframe.translation += duration * *rates.velocity;
    if (rates.spin) keyframe.rotation += duration * *rates.spin;
}

/// What a keyframe leaves out is as in the one before it, or as the rates of that lead to. rates: of the one
/// before; out: of this one.
Keyframe read_keyframe(JsonObject& from, const Keyframe* before, Rates& rates) {
    Keyframe keyframe = before ? *before : Keyframe{};
    const bool has_time = from.need("time");
    keyframe.time = from.optional_number("time", finite_number).value_or(keyframe.time);
    if (has_time && before && !(keyframe.time > before->time))
        from.problem("time", fmt::format("is {}, but must be above {}, the time of the keyframe before",
                                         keyframe.time, before->time));
    if (before) go_by(rates, keyframe.time - before->time, keyframe);
    keyframe.translation = from.vector("translate", keyframe.translation);
    Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();
    double degrees = 0;
    read_rotation(from.object("rotate"), axis, degrees);
    if (from.has("rotate")) keyframe.rotation = degrees * radians_per_degree * axis;
    for (const auto& [key, is_told] :
         {std::pair("translate", rates.velocity.has_value()), std::pair("rotate", rates.spin.has_value())})
        if (is_told && from.has(key))
            from.problem(key, "must not follow a keyframe with a velocity, which says where it leads");
    keyframe.scale = from.number("scale", keyframe.scale, positive_number);
    const std::string way = from.choice("interpolation", "smooth", {"hold", "linear", "smooth"});
    keyframe.to_next = way == "hold"     ? Interpolation::hold
                       : way == "linear" ? Interpolation::linear
                                         : Interpolation::smooth;
    rates = read_rates(from, keyframe);
    from.finish();
    return keyframe;
}

/// Whether there is a list of keyframes; keys of the short form must not be beside it. take: from when on it
/// moves the thing, if at all.
bool read_keyframes(JsonObject& from, const std::vector<const char*>& short_form, double take,
                    Motion& motion) {
    motion.centre = from.vector("centre", motion.centre);
    Rates rates;
    for (JsonObject& object : from.objects("motion")) {
        const Keyframe* before = motion.keyframes.empty() ? nullptr : &motion.keyframes.back();
        const Keyframe keyframe = read_keyframe(object, before, rates);
        if ((rates.velocity || rates.spin) && keyframe.time < take)
            object.problem("time", fmt::format("is {}, but a keyframe with a velocity must not be before "
                                               "\"take\", {}",
                                               keyframe.time, take));
        motion.keyframes.push_back(keyframe);
    }
    if (!from.has("motion")) return false;
    if (motion.keyframes.empty()) from.problem("motion", "must hold at least one keyframe");
    for (const char* key : short_form)
        if (from.has(key)) from.problem(key, "must not be beside \"motion\", whose keyframes say it");
    if (rates.velocity || rates.spin) {
        Keyframe last = motion.keyframes.back();
        go_by(rates, ever, last);
        last.time += ever;
        motion.keyframes.push_back(last);
    }
    return true;
}

/// The short form of constant velocities. start: when they begin.
Motion read_travel(JsonObject& from, double start) {
    const Eigen::Vector3d velocity = from.vector("velocity", Eigen::Vector3d::Zero()),
                          spin = from.vector("angular_velocity", Eigen::Vector3d::Zero());
    const double stop = from.number("stop", std::numeric_limits<double>::infinity(), finite_number);
    if (stop < start) from.problem("stop", "must not be before \"start\"");
    return travel(velocity, start, std::max(start, stop), spin);
}

}  // namespace

Grip read_held_motion(JsonObject& from) {
    Grip grip;
    grip.take = from.number("take", 0, not_negative);
    grip.release = from.number("release", grip.release, not_negative);
    Move move;
    move.translation = from.vector("translate", move.translation);
    Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();
    double degrees = 0;
    read_rotation(from.object("rotate"), axis, degrees);
    move.rotation = degrees * radians_per_degree * axis;
    move.start = from.number("start", grip.take, finite_number);
    move.duration = from.number("duration", 0, not_negative);
    const Motion steady = read_travel(from, move.start);
    const bool is_steady = from.has("velocity") || from.has("angular_velocity");
    if (!read_keyframes(from,
                        {"translate", "rotate", "start", "duration", "velocity", "angular_velocity", "stop"},
                        grip.take, grip.motion)) {
        move.centre = grip.motion.centre;
        const Eigen::Vector3d centre = grip.motion.centre;
        grip.motion = is_steady ? steady : eased(move);
        grip.motion.centre = centre;
        for (const char* key : {"translate", "rotate", "duration"})
            if (is_steady && from.has(key)) from.problem(key, "must not be beside a velocity");
        if (!is_steady && from.has("stop")) from.problem("stop", "needs a velocity");
        if (is_steady && move.start < grip.take) from.problem("start", "must not be before \"take\"");
    }
    if (grip.release < grip.take)
        from.problem("release", "must not be before \"take\"");
    else if (grip.release < move.start)
        from.problem("release", "must not be before \"start\"");
    return grip;
}

Motion read_obstacle_motion(JsonObject& from) {
    Motion motion, steady = read_travel(from, from.number("start", 0, finite_number));
    constexpr double always = -std::numeric_limits<double>::infinity();
    if (read_keyframes(from, {"velocity", "angular_velocity", "start", "stop"}, always, motion))
        return motion;
    steady.centre = motion.centre;
    return steady;
}

}  // namespace nbd
