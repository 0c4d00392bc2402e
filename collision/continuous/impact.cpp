#include "collision/continuous/impact.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "collision/geometry/closest_points.hpp"

namespace nbd {
namespace {

using Eigen::Vector3d;
using Corners = std::array<Vector3d, 4>;

/// Four corners in motion relative to the first one's begin; the first `split` are of feature a.
///
/// Rounding: with u = 2^-53 and m the largest absolute coordinate, of begins and ends, a coordinate at a time
/// has an error below 6 u m, as differences of two coordinates are correctly rounded. A distance of two
/// corners along a unit vector so has one below 40 u m, and its rate, extrapolated over at most the step, one
/// below 50 u m more. The direction is unit to 4 u, which adds 14 u m. 64 epsilons are 128 u.
struct Motion {
    std::size_t split;
    Corners begin, rate;
    double rounding = 0;  // bound of the error of a distance along a direction, metres

    Motion(std::size_t corners_of_a, const std::array<const MovingPoint*, 4>& x) noexcept
        : split(corners_of_a) {
        const Vector3d origin = x[0]->begin;
        double largest = 0;
        bool finite = true;
        for (std::size_t k = 0; k < 4; ++k) {
            begin[k] = x[k]->begin - origin;
            const Vector3d end = x[k]->end - origin;
            rate[k] = end - begin[k];
            finite = finite && begin[k].allFinite() && rate[k].allFinite();
            largest = std::max({largest, begin[k].cwiseAbs().maxCoeff(), end.cwiseAbs().maxCoeff()});
        }
        rounding = finite ? 64 * std::numeric_limits<double>::epsilon() * largest
                          : std::numeric_limits<double>::quiet_NaN();
    }
    Corners at(double time) const noexcept {
        Corners x;
        for (std::size_t k = 0; k < 4; ++k) x[k] = begin[k] + time * rate[k];
        return x;
    }
};

/// A plane across `direction` between the features: how far apart they are along it, and for how long it
/// keeps them apart.
struct Separation {
    double gap = 0;   // metres, now
    double time = 0;  // share of the step, from now, for which they stay farther apart than asked
};

/// Directions that are shorter have squares with few digits left, or none.
constexpr double shortest = 1e-140;

/// direction: from b to a; too short or too long ones separate nothing. apart: metres, > 0.
Separation separation(const Motion& motion, const Corners& x, const Vector3d& direction,
                      double apart) noexcept {
    const double length = direction.norm();
    if (!(length > shortest) || !std::isfinite(length)) return {};
    const Vector3d n = direction / length;
    std::array<double, 4> place, speed;
    for (std::size_t k = 0; k < 4; ++k) {
        place[k] = n.dot(x[k]);
        speed[k] = n.dot(motion.rate[k]);
    }
    Separation result{std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()};
    for (std::size_t i = 0; i < motion.split; ++i)
        for (std::size_t j = motion.split; j < 4; ++j) {
            const double gap = place[i] - place[j], closing = speed[j] - speed[i];
            result.gap = std::min(result.gap, gap);
            if (!(gap > apart)) return {gap, 0};
            if (closing > 0) result.time = std::min(result.time, (gap - apart) / closing);
        }
    return result;
}

/// The normals of the features that may separate them better than their closest points do.
std::array<Vector3d, 2> normals(const Motion& motion, const Corners& x) noexcept {
    const Vector3d normal =
        motion.split == 1 ? (x[2] - x[1]).cross(x[3] - x[1]) : (x[1] - x[0]).cross(x[3] - x[2]);
    return {normal, -normal};
}

template <class ClosestGap>
Impact search(const Motion& motion, const ImpactConfig& config, const ClosestGap& closest_gap) noexcept {
    if (!std::isfinite(motion.rounding)) return {.hits = true, .time = 0};
    const double apart = config.separation + motion.rounding;
    const double near = config.separation + std::max(config.tolerance, 2 * motion.rounding);
    Impact impact{.hits = true, .time = 0};
    while (impact.iterations < config.max_iterations) {
        const Corners x = motion.at(impact.time);
        ++impact.iterations;
        Separation best = separation(motion, x, closest_gap(x), apart);
        if (!(best.gap > near))
            for (const Vector3d& normal : normals(motion, x)) {
                const Separation other = separation(motion, x, normal, apart);
                if (other.time > best.time) best = other;
            }
        // Rounding of this sum is within that of the rates.
        const double next = impact.time + best.time;
        if (next >= 1) return {.hits = false, .time = 1, .iterations = impact.iterations};
        if (!(next > impact.time) || !(best.gap > near)) return impact;
        impact.time = next;
    }
    impact.exhausted = true;
    return impact;
}

}  // namespace

Impact vertex_face_impact(const MovingPoint& p, const MovingPoint& a, const MovingPoint& b,
                          const MovingPoint& c, const ImpactConfig& config) noexcept {
    return search(Motion(1, {&p, &a, &b, &c}), config,
                  [](const Corners& x) { return closest_point_triangle(x[0], x[1], x[2], x[3]).gap; });
}

Impact edge_edge_impact(const MovingPoint& p, const MovingPoint& q, const MovingPoint& u,
                        const MovingPoint& v, const ImpactConfig& config) noexcept {
    return search(Motion(2, {&p, &q, &u, &v}), config,
                  [](const Corners& x) { return closest_edge_edge(x[0], x[1], x[2], x[3]).gap; });
}

}  // namespace nbd
