#pragma once

#include <vector>

#include "sim/barrier/moving_surface.hpp"

namespace nbd {

/// By how much the boxes of the two features over the motion are apart along the axis on which they are most,
/// metres; negative if they overlap on all. Features of one surface move relative to its mean motion.
double boxes_apart(const FeaturePair& pair, const std::vector<MovingSurface>& surfaces);

/// Likewise before the motion.
double boxes_apart_at_begin(const FeaturePair& pair, const std::vector<MovingSurface>& surfaces);

/// Positions in the frame in which the boxes of one surface are compared, [n, 3].
inline Nodes about_mean(const Nodes& x) { return x.rowwise() - x.colwise().mean(); }
/// Rounding of differences of positions, relative to these.
inline constexpr double difference_rounding = 1e-12;

/// Distance of the two features of one surface at rest, metres.
double rest_distance(const FeaturePair& pair, const std::vector<MovingSurface>& surfaces);

}  // namespace nbd
