#pragma once

#include <limits>
#include <vector>

#include "collision/continuous/feature_pair.hpp"
#include "sim/barrier/moving_surface.hpp"

namespace nbd {

/// The weight of the potential of two features after a share of the motion, [0, 1]. Two surfaces press each
/// other where they are nearest to each other, and there once:
///
/// - A vertex nearest to the boundary of a face is that to all faces that meet there: these share evenly, or
///   leave it to one that is nearer.
/// - The weight of two edges vanishes as they become parallel, see edge_mollifier(), and towards their ends,
///   which press the faces beside the other instead.
/// - The weight vanishes as the line between the two points leans over the faces beside them: there are
///   nearer ones. Before a motion, it also vanishes as that would lead up the plane across such a line by
///   most_rise, metres: a body that goes on over the faces never meets the plane.
///
/// Without this, what slides over an edge inside of a flat face would be held back by it: before it gets
/// there, the line to the nearest point of the edge leads ahead. Two features of one surface have the weight
/// of their edges alone, since the features about them may be neighbours, which do not press.
double pair_weight(const FeaturePair& pair, const std::vector<MovingSurface>& surfaces, double share,
                   double most_rise = std::numeric_limits<double>::infinity());

}  // namespace nbd
