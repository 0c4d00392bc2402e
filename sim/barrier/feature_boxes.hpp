#pragma once

#include <vector>

#include "sim/barrier/moving_surface.hpp"

namespace nbd {

/// Whether two features may come within `distance` of each other, metres: their boxes over the motion do, and
/// so they would if their corners approached each other in the straightest way. Features of one surface move
/// relative to its mean motion.
bool may_come_within(double distance, const FeaturePair& pair, const std::vector<MovingSurface>& surfaces);

/// By how much the boxes of the two features before the motion are apart along the axis on which they are
/// most, metres; negative if they overlap on all.
double boxes_apart_at_begin(const FeaturePair& pair, const std::vector<MovingSurface>& surfaces);

/// Positions in the frame in which the boxes of one surface are compared, [n, 3].
inline Nodes about_mean(const Nodes& x) { return x.rowwise() - x.colwise().mean(); }
/// Rounding of differences of positions, relative to these.
inline constexpr double difference_rounding = 1e-12;

/// Distance of the two features of one surface at rest, metres.
double rest_distance(const FeaturePair& pair, const std::vector<MovingSurface>& surfaces);

}  // namespace nbd
