#include "sim/barrier/moving_features.hpp"

#include <algorithm>
#include <cmath>

#include "collision/continuous/feature_pair.hpp"

namespace nbd {

AxisGaps MovingFeatures::axis_gaps() const {
    const auto& [p, q, r, s] = begin;
    const auto& [p1, q1, r1, s1] = end;
    if (kind == FeatureKind::vertex_face) return {Extent(p), Extent(p1), Extent(q, r, s), Extent(q1, r1, s1)};
    return {Extent(p, q), Extent(p1, q1), Extent(r, s), Extent(r1, s1)};
}

double MovingFeatures::gap_along_line(const ClosestPoints& closest) const {
    if (!(closest.distance > 0)) return 0;
    const Eigen::Vector3d line = closest.gap / closest.distance;
    const std::size_t of_a = corners_of_a(kind);
    double least_of_a = end[0].dot(line), most_of_b = end[3].dot(line);
    for (std::size_t k = 1; k < of_a; ++k) least_of_a = std::min(least_of_a, end[k].dot(line));
    for (std::size_t k = of_a; k < 3; ++k) most_of_b = std::max(most_of_b, end[k].dot(line));
    return std::min(closest.distance, least_of_a - most_of_b);
}

double MovingFeatures::gap_by_approach() const {
    return closest_points(kind, begin).distance - relative_motion();
}

double MovingFeatures::relative_motion() const {
    std::array<Eigen::Vector3d, 4> motion;
    for (std::size_t k = 0; k < 4; ++k) motion[k] = end[k] - begin[k];
    const std::size_t of_a = corners_of_a(kind);
    double most = 0;
    for (std::size_t k = 0; k < of_a; ++k)
        for (std::size_t l = of_a; l < 4; ++l) most = std::max(most, (motion[k] - motion[l]).squaredNorm());
    return std::sqrt(most);
}

bool MovingFeatures::may_press(double reach) const {
    const AxisGaps gaps = axis_gaps();
    if (gaps.in_motion > near_share * reach) return false;
    const double most = reach + relative_motion();
    if (gaps.at_begin > most) return false;
    const ClosestPoints closest = closest_points(kind, begin);
    return closest.distance <= most && gap_along_line(closest) <= near_share * reach;
}

MovingFeatures moving_features(const FeaturePair& pair, const std::vector<MovingSurface>& surfaces) {
    MovingFeatures features{.kind = pair.kind, .begin = {}, .end = {}};
    const auto at = corners(pair, surfaces);
    for (std::size_t k = 0; k < 4; ++k) {
        features.begin[k] = surfaces[at[k].surface].begin(at[k].vertex);
        features.end[k] = surfaces[at[k].surface].end(at[k].vertex);
    }
    return features;
}

double rest_distance(const FeaturePair& pair, const std::vector<MovingSurface>& surfaces) {
    const Nodes& X = surfaces[pair.surface_a].rest();
    std::array<Eigen::Vector3d, 4> x;
    const auto at = corners(pair, surfaces);
    for (std::size_t k = 0; k < 4; ++k) x[k] = X.row(at[k].vertex);
    return closest_points(pair.kind, x).distance;
}

}  // namespace nbd
