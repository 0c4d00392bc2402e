#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include "sim/scene/read_parts.hpp"

namespace nbd {
namespace {

constexpr double radians_per_degree = std::numbers::pi / 180;

/// What a keyframe leaves out is as in the one before it.
Keyframe read_keyframe(JsonObject& from, const Keyframe* before) {
    Keyframe keyframe = before ? *before : Keyframe{};
    const bool has_time = from.need("time");
    keyframe.time = from.optional_number("time", finite_number).value_or(keyframe.time);
    if (has_time && before && !(keyframe.time > before->time))
        from.problem("time", fmt::format("is {}, but must be above {}, the time of the keyframe before",
                                         keyframe.time, before->time));
    keyframe.translation = from.vector("translate", keyframe.translation);
    Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();
    double degrees = 0;
    read_rotation(from.object("rotate"), axis, degrees);
    if (from.has("rotate")) keyframe.rotation = degrees * radians_per_degree * axis;
    keyframe.scale = from.number("scale", keyframe.scale, positive_number);
    const std::string way = from.choice("interpolation", "smooth", {"hold", "linear", "smooth"});
    keyframe.to_next = way == "hold"     ? Interpolation::hold
                       : way == "linear" ? Interpolation::linear
                                         : Interpolation::smooth;
    from.finish();
    return keyframe;
}

/// Whether there is a list of keyframes; keys of the short form must not be beside it.
bool read_keyframes(JsonObject& from, const std::vector<const char*>& short_form, Motion& motion) {
    motion.centre = from.vector("centre", motion.centre);
    for (JsonObject& keyframe : from.objects("motion"))
        motion.keyframes.push_back(
            read_keyframe(keyframe, motion.keyframes.empty() ? nullptr : &motion.keyframes.back()));
    if (!from.has("motion")) return false;
    if (motion.keyframes.empty()) from.problem("motion", "must hold at least one keyframe");
    for (const char* key : short_form)
        if (from.has(key)) from.problem(key, "must not be beside \"motion\", whose keyframes say it");
    return true;
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
    if (!read_keyframes(from, {"translate", "rotate", "start", "duration"}, grip.motion)) {
        move.centre = grip.motion.centre;
        grip.motion = eased(move);
    }
    if (grip.release < grip.take)
        from.problem("release", "must not be before \"take\"");
    else if (grip.release < move.start)
        from.problem("release", "must not be before \"start\"");
    return grip;
}

Motion read_obstacle_motion(JsonObject& from) {
    Motion motion;
    const Eigen::Vector3d velocity = from.vector("velocity", Eigen::Vector3d::Zero());
    const double start = from.number("start", 0, finite_number);
    const double stop = from.number("stop", std::numeric_limits<double>::infinity(), finite_number);
    if (stop < start) from.problem("stop", "must not be before \"start\"");
    if (read_keyframes(from, {"velocity", "start", "stop"}, motion)) return motion;
    const Eigen::Vector3d centre = motion.centre;
    motion = travel(velocity, start, std::max(start, stop));
    motion.centre = centre;
    return motion;
}

}  // namespace nbd
