#pragma once

#include <vector>

#include "sim/barrier/moving_surface.hpp"
#include "sim/barrier/near_pair.hpp"

namespace nbd {

/// Share of its distance at rest at which a pair of features of one surface presses.
inline constexpr double rest_share = HostProof::least_share;

/// Watches the features of one surface that queries of its tree leave out, see neighbour_features(). It knows
/// by how much each pair was apart in a reference pose, and looks only at those that the motion since then
/// may have brought near. Of a surface that hangs on nodes, a HostProof tells more for less.
class NeighbourWatch {
 public:
    /// surface: number of a body's surface.
    NeighbourWatch(const std::vector<MovingSurface>& surfaces, int surface);

    /// Appends all pairs that MovingFeatures::may_press() within their reach: `reach`, or rest_share of the
    /// distance at rest if that is less.
    void find(const std::vector<MovingSurface>& surfaces, double reach, std::vector<NearFeatures>& near);

 private:
    void refer_to_begin(const std::vector<MovingSurface>& surfaces);

    std::size_t surface_;
    std::vector<NearFeatures> pairs_;  // reach: rest_share of the distance at rest
    Nodes reference_;                  // positions about their mean, [n, 3]; empty: none yet
    std::vector<double> apart_;        // [pairs_] of their boxes in the reference pose
    std::vector<int> looked_at_;       // pairs, in the last find()
    std::vector<char> keeps_;          // [looked_at_]
};

}  // namespace nbd
