#pragma once

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

    /// All of them, sorted.
    std::vector<Intersection> find(std::vector<MovingSurface>& surfaces);

 private:
    PairQuery pair_query_;
    SelfQuery self_query_;
    std::vector<Intersection> candidates_, neighbours_;  // neighbours_: faces with a common vertex
};

/// A line that names the first intersections and their number. Not empty.
std::string intersection_text(const std::vector<Intersection>& intersections,
                              const std::vector<MovingSurface>& surfaces);

}  // namespace nbd
