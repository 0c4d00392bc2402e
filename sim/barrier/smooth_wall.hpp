#pragma once

#include <Eigen/Core>
#include <variant>

#include "sim/obstacles/obstacle.hpp"

namespace nbd {

/// A plane or ball in a step. A plane turns evenly about the centre of its motion, the shortest way; the
/// centre and the radius of a ball change evenly. progress: share of the step that is over, in [0, 1].
class SmoothWall {
 public:
    explicit SmoothWall(const Obstacle& obstacle) : obstacle_(obstacle) { begin_step({}, {}); }

    /// start, end: where the obstacle is at the ends of the step.
    void begin_step(const Placing& start, const Placing& end);

    SurfaceDistance distance(const Eigen::Vector3d& p, double progress) const noexcept;

    /// A point goes straight from `from` to `to` while the step goes on from `progress` to its end. A bound
    /// of its way as seen from the wall: of how much its distance changes, metres.
    double relative_way(const Eigen::Vector3d& from, const Eigen::Vector3d& to,
                        double progress) const noexcept;

    /// A share in [0, 1] of this motion in which the point comes no nearer than `least`, metres; 1 if it
    /// never does. Beside a plane that turns, the distance at its end may be larger, by `tolerance` if the
    /// share is below 1. At the begin, the distance must be at least `least`, or the share may be 0.
    double limit(const Eigen::Vector3d& from, const Eigen::Vector3d& to, double progress, double least,
                 double tolerance) const noexcept;

    /// Way in the whole step of the wall's point that is nearest to p at `progress`, metres.
    Eigen::Vector3d way_of(const Eigen::Vector3d& p, double progress) const noexcept;

 private:
    const BallShape* ball() const noexcept { return std::get_if<BallShape>(&obstacle_.shape); }
    bool only_shifts() const noexcept { return start_.is_shift && end_.is_shift; }
    BallShape ball_at(double progress) const noexcept;
    Placing at(double progress) const noexcept { return between(start_, end_, progress); }
    Eigen::Vector3d pivot(double progress) const noexcept;
    double limit_beside_plane(const Eigen::Vector3d& from, const Eigen::Vector3d& to, double progress,
                              double least, double tolerance) const noexcept;

    Obstacle obstacle_;
    Placing start_, end_;
    BallShape first_, last_;                           // of a ball, at the ends of the step
    Eigen::Vector3d axis_ = Eigen::Vector3d::UnitZ();  // of a plane's turn in the step, unit
    double angle_ = 0, tilt_ = 0;  // of this turn, radians; sine of the angle between the axis and the normal
};

}  // namespace nbd
