#pragma once

#include <Eigen/Core>
#include <limits>
#include <vector>

namespace nbd {

/// How a motion goes on from a keyframe.
enum class Interpolation {
    hold,    // it stands there, and is at the next keyframe at once when its time has come
    linear,  // evenly
    smooth,  // it eases in and out: without speed at both keyframes
};

/// Where something is at a time, as a displacement from where it was taken: it is scaled and turned about the
/// centre of the motion, and then moved.
struct Keyframe {
    double time = 0;                                        // seconds
    Eigen::Vector3d translation = Eigen::Vector3d::Zero();  // metres
    Eigen::Vector3d rotation = Eigen::Vector3d::Zero();     // axis times angle, radians; any number of turns
    double scale = 1;                                       // > 0
    Interpolation to_next = Interpolation::smooth;

    /// Whether both are in the same place.
    bool is_where(const Keyframe& other) const noexcept {
        return translation == other.translation && rotation == other.rotation && scale == other.scale;
    }
};

/// A displacement of everything: p goes to centre + scale turn (p - centre) + translation.
struct Placing {
    Eigen::Vector3d centre = Eigen::Vector3d::Zero(), translation = Eigen::Vector3d::Zero();
    Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
    double scale = 1;
    bool is_shift = true;  // translation alone

    Eigen::Vector3d operator()(const Eigen::Vector3d& p) const noexcept {
        if (is_shift) return p + translation;
        return centre + scale * (turn * (p - centre)) + translation;
    }
    /// Where the point that is now at p came from.
    Eigen::Vector3d inverse(const Eigen::Vector3d& p) const noexcept {
        if (is_shift) return p - translation;
        return centre + turn.transpose() * (p - translation - centre) / scale;
    }
};

/// A motion that is told in advance. Before the first keyframe and after the last one it stands there;
/// without keyframes it stands in its place. Between two rotations about one axis, or about opposite ones,
/// the angle goes from number to number, by as many turns as they are apart; between rotations about
/// different axes it turns the shortest way.
struct Motion {
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();  // of rotations and scales, metres
    std::vector<Keyframe> keyframes{};                 // times ascend

    Keyframe keyframe_at(double time) const noexcept;
    Placing at(double time) const noexcept;
    /// Whether it is in one place for ever.
    bool stands() const noexcept;
    /// Whether that is its own place.
    bool stays() const noexcept;
    /// Whether it stands between two times, or has come to its place at once.
    bool rests(double begin, double end) const noexcept;
    /// Makes it go evenly from where it is at `begin` to a place at `end`, seconds, turned the shortest way,
    /// and forgets what was told for later.
    void go_to(Keyframe place, double begin, double end);
};

/// Between two placings of one motion, share in [0, 1]: turned the shortest way.
Placing between(const Placing& a, const Placing& b, double share) noexcept;

/// The angle by which it turns the shortest way, in [0, pi] radians.
double angle_between(const Placing& a, const Placing& b) noexcept;

/// One move that eases in and out, or is done at once if its duration is 0.
struct Move {
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();       // of the rotation, metres
    Eigen::Vector3d translation = Eigen::Vector3d::Zero();  // metres, over the whole move
    Eigen::Vector3d rotation = Eigen::Vector3d::Zero();     // axis times angle, radians, likewise
    double start = 0, duration = 0;                         // seconds
};
Motion eased(const Move& move);

/// For ever, as far as motions go: 34 years, in seconds. A power of two, so that rounding is that of the way
/// alone.
constexpr double ever = 0x1p30;

/// A motion at a constant velocity, m/s, from `start` to `stop`, seconds; for ever: for `ever`. spin: angular
/// velocity about the centre, which goes along, rad/s.
Motion travel(const Eigen::Vector3d& velocity, double start = 0,
              double stop = std::numeric_limits<double>::infinity(),
              const Eigen::Vector3d& spin = Eigen::Vector3d::Zero());

/// Throws std::invalid_argument, without the name of what moves, unless all numbers are finite, times ascend
/// and scales are positive.
void check_motion(const Motion& motion);

}  // namespace nbd
