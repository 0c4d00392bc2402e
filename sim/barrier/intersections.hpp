#pragma once

#include <span>
#include <string>
#include <vector>

#include "collision/query/pair_query.hpp"
#include "collision/query/self_query.hpp"
#include "sim/barrier/moving_surface.hpp"

namespace nbd {

/// Two faces that have a point in common besides their common vertices and edge.
struct Intersection {
    int surface_a = 0, surface_b = 0;
    int a = 0, b = 0;  // faces
    auto operator<=>(const Intersection&) const = default;
};

/// Finds intersecting faces at the end of the surfaces' motion, by exact tests of positions in double
/// precision: between surfaces, and within each surface of a body. Faces with one common vertex intersect
/// where one meets the opposite side of the other; faces with a common edge where one lies on the other.
class IntersectionSearch {
 public:
    /// Call once, when all surfaces are there.
    void begin(const std::vector<MovingSurface>& surfaces);

    /// All of them, sorted. Of surfaces with a HostProof without those that this excludes.
    std::vector<Intersection> find(std::vector<MovingSurface>& surfaces);
    /// All that the surfaces of bodies have with themselves. A HostProof takes it that at rest there are
    /// none.
    std::vector<Intersection> find_at_rest(std::vector<MovingSurface>& surfaces);

 private:
    std::span<const FacePair> open_pairs(MovingSurface& surface, float distance);
    std::vector<Intersection> keep_intersecting(const std::vector<MovingSurface>& surfaces) const;

    PairQuery pair_query_;
    SelfQuery self_query_;

    std::vector<Intersection> candidates_;
    std::vector<Intersection> neighbours_;  // faces with a common vertex, of surfaces without a HostProof
};

/// A line that names the first intersections and their number. Not empty.
std::string intersection_text(const std::vector<Intersection>& intersections,
                              const std::vector<MovingSurface>& surfaces);

}  // namespace nbd
