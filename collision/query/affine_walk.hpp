#pragma once

#include <cstdint>
#include <vector>

#include "collision/bounds/affine/affine_boxes.hpp"
#include "collision/geometry/geometry.hpp"

namespace nbd {

/// Counters of a walk.
struct AffineWalkCounters {
    long node_tests = 0;  // pairs of boxes of clusters, blocks and leaves compared, at most
    long leaf_pairs = 0;  // pairs of leaves whose boxes are near
    long box_tests = 0;   // pairs of boxes of faces compared, at most
};

/// Finds the faces of two bodies with wide trees whose boxes are near each other. Goes level by level, so
/// that the data of later nodes can be prefetched. Owns its scratch memory.
class AffineWalk {
 public:
    /// Writes pairs of slots, in no order, to `pairs`. distance: metres; 0: boxes that have a point in
    /// common. No pair of faces within the distance is left out.
    void near_faces(AffineBoxes& a, AffineBoxes& b, float distance, std::vector<FacePair>& pairs) noexcept;

    const AffineWalkCounters& counters() const noexcept { return counters_; }

 private:
    struct Pair {
        int a, b;
    };
    template <class Near>
    void walk(AffineBoxes& a, AffineBoxes& b, const Near& near, std::vector<FacePair>& pairs) noexcept;
    template <class Near>
    void find_clusters(AffineBoxes& a, AffineBoxes& b, const Near& near) noexcept;

    std::vector<std::uint16_t> near_a_, near_b_;  // a bit per cluster
    std::vector<Pair> clusters_, blocks_, leaves_;
    AffineWalkCounters counters_;
};

}  // namespace nbd
