#pragma once

#include <Eigen/Core>
#include <array>
#include <span>
#include <vector>

#include "sim/barrier/moving_surface.hpp"
#include "sim/barrier/near_pair.hpp"

namespace nbd {

/// The box of some points along the axes of coordinates.
struct Extent {
    Eigen::Array3d low, high;

    template <class... Point>
    explicit Extent(const Eigen::Vector3d& first, const Point&... others)
        : low(first.array()), high(first.array()) {
        ((low = low.min(others.array()), high = high.max(others.array())), ...);
    }
};

/// Less than the distance of two sets of points: the gap between them along the axis on which it is largest;
/// negative if they overlap on all.
struct AxisGaps {
    double at_begin;
    /// At any time of a motion that is straight for each point. Along a line the gap is a concave function of
    /// time, so that it is least at one of the ends.
    double in_motion;

    AxisGaps(const Extent& begin_a, const Extent& end_a, const Extent& begin_b, const Extent& end_b) {
        const Eigen::Array3d a_above = begin_a.low - begin_b.high, b_above = begin_b.low - begin_a.high;
        at_begin = a_above.max(b_above).maxCoeff();
        in_motion = a_above.min(end_a.low - end_b.high).max(b_above.min(end_b.low - end_a.high)).maxCoeff();
    }
};

/// Two features during a motion that is straight for each of their four corners. Those of feature a come
/// first.
struct MovingFeatures {
    FeatureKind kind;
    std::array<Eigen::Vector3d, 4> begin, end;

    AxisGaps axis_gaps() const;
    /// As AxisGaps::in_motion, along the line of their closest points at the begin; 0 if they meet there.
    double gap_along_line(const ClosestPoints& closest) const;
    /// Less than their distance at any time: that at the begin less relative_motion().
    double gap_by_approach() const;
    /// The largest motion of a corner of one relative to a corner of the other.
    double relative_motion() const;
    /// Whether they may press where they do so within `reach`, metres: by the tight bounds they come within
    /// near_share of it, and by their approach within it if that leads straight to each other.
    bool may_press(double reach) const;
};

MovingFeatures moving_features(const FeaturePair& pair, const std::vector<MovingSurface>& surfaces);

/// Positions in the frame in which poses of one surface are compared, [n, 3].
inline Nodes about_mean(const Nodes& x) { return x.rowwise() - x.colwise().mean(); }
/// Rounding of differences of positions, relative to these.
inline constexpr double difference_rounding = 1e-12;

/// Distance of the two features of one surface at rest, metres.
double rest_distance(const FeaturePair& pair, const std::vector<MovingSurface>& surfaces);

}  // namespace nbd
