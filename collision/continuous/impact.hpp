#pragma once

#include <Eigen/Core>

namespace nbd {

/// A corner of a feature that moves straight from `begin` to `end` over a step. Metres.
struct MovingPoint {
    Eigen::Vector3d begin, end;
};

struct ImpactConfig {
    double separation = 0;      // metres, >= 0: the features collide where they come this near
    double tolerance = 0;       // metres, >= 0: the search may end with "hits" where they come nearer than
                                // separation + tolerance; the least tolerance is that of rounding
    int max_iterations = 2048;  // >= 1; then the search ends with "hits", `exhausted`
};

/// What a search for an impact found.
struct Impact {
    bool hits = false;       // false: the features stay farther apart than `separation` over the whole step
    double time = 1;         // share of the step up to which that is certain, in [0, 1]; 1 if they do not hit
    int iterations = 0;      // closest points computed
    bool exhausted = false;  // the search ran out of iterations: whether they hit after `time` is not known
};

/// Whether a vertex p meets the face abc, or the edge pq the edge uv, while all move straight. Touching
/// counts, also at the ends of the step, and degenerate features count as the segments or points that they
/// are. No collision is missed: rounding errors are bounded, and a search that runs out of iterations ends
/// with "hits" and says so. A number that is not finite hits at time 0. Allocates nothing.
///
/// Features that pass each other very closely may be reported, too. Relative to the largest difference of two
/// coordinates: within 3e-14 where the closest points lie inside of a face or of both edges, and within 2e-8,
/// the rounding of so short a direction, where a vertex passes an edge or a vertex.
/// A search takes two to thirty iterations as a rule; features that slide past each other at 1e-4 of
/// their size have taken up to 800.
///
/// Units are free within 1e-70 to 1e70 metres. Of smaller differences, squares lose digits or vanish (as do
/// denormal numbers, whether the processor keeps them or not), larger ones overflow: no plane is trusted
/// there, and features that are not kept apart by another one hit.
///
/// A plane between the features separates them for a time that is known exactly, as the distances of corners
/// from a fixed plane are linear in time. The search goes on from the end of that time with another plane:
/// conservative advancement [MirtichCanny95], by planes in place of the distance as in [LiKaufmanJiang21].
Impact vertex_face_impact(const MovingPoint& p, const MovingPoint& a, const MovingPoint& b,
                          const MovingPoint& c, const ImpactConfig& config = {}) noexcept;
Impact edge_edge_impact(const MovingPoint& p, const MovingPoint& q, const MovingPoint& u,
                        const MovingPoint& v, const ImpactConfig& config = {}) noexcept;

}  // namespace nbd
