#pragma once

#include <Eigen/Core>
#include <array>
#include <span>
#include <vector>

#include "sim/barrier/moving_surface.hpp"
#include "sim/barrier/near_pair.hpp"

namespace nbd {

/// Less than the distance of two sets of corners at any time of a motion that is straight for each corner:
/// the gap between them along the axis of coordinates on which it is largest; negative if they overlap on
/// all. Along a line the gap is a concave function of time, so that it is least at one of the ends.
double gap_along_axes(std::span<const Eigen::Vector3d> begin_a, std::span<const Eigen::Vector3d> end_a,
                      std::span<const Eigen::Vector3d> begin_b, std::span<const Eigen::Vector3d> end_b);

/// Two features during a motion that is straight for each of their four corners. Those of feature a come
/// first.
struct MovingFeatures {
    FeatureKind kind;
    std::array<Eigen::Vector3d, 4> begin, end;

    /// See above.
    double gap_along_axes() const;
    /// Likewise, along the line of their closest points at the begin; 0 if they meet there.
    double gap_along_shortest_line() const;
    /// Likewise, less tight: their distance at the begin less relative_motion().
    double gap_by_approach() const;
    /// The largest motion of a corner of one relative to a corner of the other.
    double relative_motion() const;
    /// Whether they may press where they do so within `reach`, metres: by the tight bounds they come within
    /// near_share of it, and by their approach within it if that leads straight to each other.
    bool may_press(double reach) const;

 private:
    double gap_along_line(const ClosestPoints& closest) const;
};

MovingFeatures moving_features(const FeaturePair& pair, const std::vector<MovingSurface>& surfaces);

/// Positions in the frame in which poses of one surface are compared, [n, 3].
inline Nodes about_mean(const Nodes& x) { return x.rowwise() - x.colwise().mean(); }
/// Rounding of differences of positions, relative to these.
inline constexpr double difference_rounding = 1e-12;

/// Distance of the two features of one surface at rest, metres.
double rest_distance(const FeaturePair& pair, const std::vector<MovingSurface>& surfaces);

}  // namespace nbd
