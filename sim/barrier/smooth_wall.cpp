#include "sim/barrier/smooth_wall.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

namespace nbd {
namespace {

BallShape placed_ball(const Placing& placing, const BallShape& ball) {
    return {.centre = placing(ball.centre), .radius = placing.scale * ball.radius};
}

/// Share of the motion from p to q, relative to the centre of a ball, after which the point is as far from
/// the centre as a radius that changes evenly; at least 1 if it is not in the motion.
double time_to_ball(const Eigen::Vector3d& p, const Eigen::Vector3d& q, double radius, double growth) {
    const Eigen::Vector3d r = q - p;
    const double a = r.squaredNorm() - growth * growth, b = p.dot(r) - radius * growth,
                 c = p.squaredNorm() - radius * radius;
    const double discriminant = b * b - a * c;
    if ((b >= 0 && a >= 0) || discriminant <= 0) return 1;
    return c / (std::sqrt(discriminant) - b);
}

}  // namespace

void SmoothWall::begin_step(const Placing& start, const Placing& end) {
    start_ = start;
    end_ = end;
    angle_ = tilt_ = 0;
    if (ball()) {
        first_ = placed_ball(start, *ball());
        last_ = placed_ball(end, *ball());
        return;
    }
    if (only_shifts()) return;
    const Eigen::AngleAxisd turn(end.turn * start.turn.transpose());
    axis_ = turn.axis();
    angle_ = turn.angle();
    const Eigen::Vector3d normal = start.turn * std::get<PlaneShape>(obstacle_.shape).normal;
    tilt_ = axis_.cross(normal).norm();
}

BallShape SmoothWall::ball_at(double progress) const noexcept {
    return {.centre = first_.centre + progress * (last_.centre - first_.centre),
            .radius = first_.radius + progress * (last_.radius - first_.radius)};
}

/// The point about which the plane turns.
Eigen::Vector3d SmoothWall::pivot(double progress) const noexcept {
    return start_.centre + start_.translation + progress * (end_.translation - start_.translation);
}

SurfaceDistance SmoothWall::distance(const Eigen::Vector3d& p, double progress) const noexcept {
    constexpr double all = std::numeric_limits<double>::infinity();
    if (ball()) return *signed_distance_at_rest({.shape = ball_at(progress)}, p, all);
    if (!only_shifts()) return *signed_distance(obstacle_, at(progress), p, all);
    const Eigen::Vector3d shift = start_.translation + progress * (end_.translation - start_.translation);
    return *signed_distance_at_rest(obstacle_, p - shift, all);
}

double SmoothWall::relative_way(const Eigen::Vector3d& from, const Eigen::Vector3d& to,
                                double progress) const noexcept {
    const double rest = 1 - progress;
    if (ball())
        return (to - from - rest * (last_.centre - first_.centre)).norm() +
               rest * std::abs(last_.radius - first_.radius);
    const Eigen::Vector3d way = to - from - rest * (end_.translation - start_.translation);
    if (only_shifts()) return way.norm();
    const PlaneShape& plane = std::get<PlaneShape>(obstacle_.shape);
    const double arm = std::max((from - pivot(progress)).norm(), (to - pivot(1)).norm()),
                 height = std::abs(plane.normal.dot(plane.point - start_.centre));
    return way.norm() + rest * (angle_ * tilt_ * arm + std::abs(end_.scale - start_.scale) * height);
}

double SmoothWall::limit(const Eigen::Vector3d& from, const Eigen::Vector3d& to, double progress,
                         double least, double tolerance) const noexcept {
    if (ball()) {
        const BallShape now = ball_at(progress);
        return std::min(
            time_to_ball(from - now.centre, to - last_.centre, now.radius + least, last_.radius - now.radius),
            1.0);
    }
    if (angle_ * tilt_ > 0) return limit_beside_plane(from, to, progress, least, tolerance);
    const double begin = distance(from, progress).distance, end = distance(to, 1).distance;
    return end >= least ? 1 : std::max(begin - least, 0.0) / (begin - end);
}

/// Goes on as far as the distance, its slope and a bound of its second derivative allow, again and again.
/// With y, the way of the point as seen from the pivot, linear in the share s, and the normal n that turns by
/// the angle t about the axis a, the distance n.y - k has the slope t (a x n).y + n.y' - k' and a second
/// derivative of at most |a x n| t (t |y| + 2 |y'|).
double SmoothWall::limit_beside_plane(const Eigen::Vector3d& from, const Eigen::Vector3d& to, double progress,
                                      double least, double tolerance) const noexcept {
    constexpr int most = 256;
    const double rest = 1 - progress, angle = rest * angle_;
    const PlaneShape& plane = std::get<PlaneShape>(obstacle_.shape);
    const double lift = rest * (end_.scale - start_.scale) * plane.normal.dot(plane.point - start_.centre);
    const Eigen::Vector3d begin = from - pivot(progress), way = to - pivot(1) - begin;
    const double bend =
        tilt_ * angle * (angle * std::max(begin.norm(), (begin + way).norm()) + 2 * way.norm());
    double share = 0;
    for (int k = 0; k < most; ++k) {
        const SurfaceDistance now = distance(from + share * (to - from), progress + share * rest);
        const double room = now.distance - least;
        if (k > 0 && room <= tolerance) return share;
        if (room <= 0) return 0;
        const double slope =
            angle * axis_.cross(now.normal).dot(begin + share * way) + now.normal.dot(way) - lift;
        const double root = std::sqrt(slope * slope + 2 * bend * room);
        share += slope < 0 ? 2 * room / (root - slope) : (slope + root) / bend;
        if (share >= 1) return 1;
    }
    return share;
}

Eigen::Vector3d SmoothWall::way_of(const Eigen::Vector3d& p, double progress) const noexcept {
    if (only_shifts()) return end_.translation - start_.translation;
    const SurfaceDistance nearest = distance(p, progress);
    const Eigen::Vector3d point = at(progress).inverse(p - nearest.distance * nearest.normal);
    return end_(point) - start_(point);
}

}  // namespace nbd
