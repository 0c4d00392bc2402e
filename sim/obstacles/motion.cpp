#include "sim/obstacles/motion.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

namespace nbd {
namespace {

/// Times of steps are sums, so a keyframe counts from this long before its time on, seconds.
constexpr double slack = 1e-9;

bool are_parallel(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
    return a.cross(b).norm() <= 1e-9 * a.norm() * b.norm();
}

Eigen::Quaterniond turn_of(const Eigen::Vector3d& rotation) {
    const double angle = rotation.norm();
    if (angle == 0) return Eigen::Quaterniond::Identity();
    return Eigen::Quaterniond(Eigen::AngleAxisd(angle, rotation / angle));
}

Eigen::Vector3d rotation_between(const Eigen::Vector3d& a, const Eigen::Vector3d& b, double share) {
    if (are_parallel(a, b)) return a + share * (b - a);
    const Eigen::AngleAxisd turn(turn_of(a).slerp(share, turn_of(b)));
    return turn.angle() * turn.axis();
}

/// The number of keyframes whose time has come.
std::size_t reached(const std::vector<Keyframe>& keyframes, double time) {
    const auto next = std::ranges::upper_bound(keyframes, time + slack, {}, &Keyframe::time);
    return next - keyframes.begin();
}

}  // namespace

Keyframe Motion::keyframe_at(double time) const noexcept {
    if (keyframes.empty()) return {.time = time};
    const std::size_t next = reached(keyframes, time);
    Keyframe now = keyframes[next > 0 ? next - 1 : 0];
    const double since = time - now.time;
    now.time = time;
    if (next == 0 || next == keyframes.size() || now.to_next == Interpolation::hold) return now;
    const Keyframe& from = keyframes[next - 1];
    const Keyframe& to = keyframes[next];
    const double u = std::clamp(since / (to.time - from.time), 0.0, 1.0);
    const double share = from.to_next == Interpolation::linear ? u : u * u * (3 - 2 * u);
    now.translation += share * (to.translation - from.translation);
    now.rotation = rotation_between(from.rotation, to.rotation, share);
    now.scale += share * (to.scale - from.scale);
    return now;
}

Placing Motion::at(double time) const noexcept {
    const Keyframe now = keyframe_at(time);
    Placing placing{.centre = centre, .translation = now.translation, .scale = now.scale};
    placing.is_shift = now.rotation.isZero(0) && now.scale == 1;
    if (const double angle = now.rotation.norm(); angle > 0)
        placing.turn = Eigen::AngleAxisd(angle, now.rotation / angle).toRotationMatrix();
    return placing;
}

bool Motion::stands() const noexcept {
    return std::ranges::all_of(keyframes, [&](const Keyframe& k) { return k.is_where(keyframes.front()); });
}

bool Motion::stays() const noexcept {
    return stands() && (keyframes.empty() || keyframes.front().is_where(Keyframe{}));
}

bool Motion::rests(double begin, double end) const noexcept {
    if (keyframe_at(begin).is_where(keyframe_at(end))) return true;
    for (std::size_t k = reached(keyframes, begin); k < reached(keyframes, end); ++k)
        if (k > 0 && keyframes[k - 1].to_next == Interpolation::hold) return true;
    return false;
}

void Motion::go_to(Keyframe place, double begin, double end) {
    Keyframe now = keyframe_at(begin);
    now.to_next = Interpolation::linear;
    const auto later = std::ranges::lower_bound(keyframes, begin - slack, {}, &Keyframe::time);
    keyframes.erase(later, keyframes.end());
    keyframes.push_back(now);
    if (const double angle = place.rotation.norm(); angle > 0 && are_parallel(now.rotation, place.rotation)) {
        constexpr double whole = 2 * std::numbers::pi;
        const Eigen::Vector3d axis = place.rotation / angle;
        place.rotation += std::round((now.rotation.dot(axis) - angle) / whole) * whole * axis;
    }
    place.time = end;
    keyframes.push_back(place);
}

Placing between(const Placing& a, const Placing& b, double share) noexcept {
    if (share == 0) return a;
    if (share == 1) return b;
    Placing result{.centre = a.centre,
                   .translation = a.translation + share * (b.translation - a.translation),
                   .scale = a.scale + share * (b.scale - a.scale)};
    result.is_shift = a.is_shift && b.is_shift;
    if (result.is_shift) return result;
    result.turn = a.turn;
    const Eigen::AngleAxisd rest(a.turn.transpose() * b.turn);
    if (rest.angle() > 0)
        result.turn = a.turn * Eigen::AngleAxisd(share * rest.angle(), rest.axis()).toRotationMatrix();
    return result;
}

double angle_between(const Placing& a, const Placing& b) noexcept {
    if (a.is_shift && b.is_shift) return 0;
    return Eigen::AngleAxisd(a.turn.transpose() * b.turn).angle();
}

Motion eased(const Move& move) {
    Motion motion{.centre = move.centre};
    if (move.translation.isZero(0) && move.rotation.isZero(0)) return motion;
    const double before = move.duration > 0 ? move.start : move.start - 1;
    motion.keyframes = {
        {.time = before, .to_next = move.duration > 0 ? Interpolation::smooth : Interpolation::hold},
        {.time = move.start + move.duration, .translation = move.translation, .rotation = move.rotation}};
    return motion;
}

Motion travel(const Eigen::Vector3d& velocity, double start, double stop, const Eigen::Vector3d& spin) {
    Motion motion;
    const double duration = std::isfinite(stop) ? stop - start : ever;
    if ((velocity.isZero(0) && spin.isZero(0)) || duration == 0) return motion;
    motion.keyframes = {
        {.time = start, .to_next = Interpolation::linear},
        {.time = start + duration, .translation = duration * velocity, .rotation = duration * spin}};
    return motion;
}

void check_motion(const Motion& motion) {
    if (!motion.centre.allFinite()) throw std::invalid_argument("the centre of its motion is not finite");
    for (std::size_t k = 0; k < motion.keyframes.size(); ++k) {
        const Keyframe& keyframe = motion.keyframes[k];
        if (!std::isfinite(keyframe.time) || !keyframe.translation.allFinite() ||
            !keyframe.rotation.allFinite() || !(keyframe.scale > 0) || !std::isfinite(keyframe.scale))
            throw std::invalid_argument(
                fmt::format("keyframe {} of its motion is not finite, or its scale is not positive", k));
        if (k > 0 && !(keyframe.time > motion.keyframes[k - 1].time))
            throw std::invalid_argument(
                fmt::format("keyframe {} of its motion is at {} s, but must be after {} s, the time of the "
                            "one before it",
                            k, keyframe.time, motion.keyframes[k - 1].time));
    }
}

}  // namespace nbd
