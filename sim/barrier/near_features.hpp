#pragma once

#include <span>
#include <vector>

#include "collision/query/pair_query.hpp"
#include "collision/query/self_query.hpp"
#include "sim/barrier/moving_surface.hpp"
#include "sim/barrier/neighbour_watch.hpp"
#include "sim/fem/step_report.hpp"

namespace nbd {

/// Finds the features that may come near: between surfaces, and within each surface of a body. Obstacles are
/// not compared with each other, nor with themselves.
class NearFeatureSearch {
 public:
    /// Call once, when all surfaces are there. Pairs within a surface that touch at rest never press; see
    /// Barrier::check_rest().
    void begin(const std::vector<MovingSurface>& surfaces);

    /// All pairs whose boxes over the whole motion come within their reach, sorted; among them all whose
    /// distance does. surfaces: those of begin(), moved. reach: metres. Valid until the next call.
    std::span<const NearFeatures> find(std::vector<MovingSurface>& surfaces, double reach);

    /// Pairs of faces looked at by the last find(), and the time of its queries.
    const StepReport& costs() const noexcept { return costs_; }

 private:
    void keep_near(const std::vector<MovingSurface>& surfaces, double reach);

    PairQuery pair_query_;
    SelfQuery self_query_;
    std::vector<NeighbourWatch> neighbours_;  // of the bodies' surfaces
    std::vector<NearFeatures> found_, kept_;
    std::vector<char> keeps_;  // [found_]
    StepReport costs_;
};

}  // namespace nbd
