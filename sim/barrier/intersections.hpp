#pragma once

#include <span>
#include <string>
#include <vector>

#include "collision/query/pair_query.hpp"
#include "collision/query/self_query.hpp"
#include "sim/barrier/moving_surface.hpp"
#include "sim/contact/pair_rules.hpp"

namespace nbd {

/// Two faces that have a point in common besides their common vertices and edge.
struct Intersection {
    int surface_a = 0, surface_b = 0;
    int a = 0, b = 0;  // faces
    auto operator<=>(const Intersection&) const = default;
};

/// Finds intersecting faces in a pose of the surfaces, a motion that ends as it begins, by exact tests of
/// positions in double precision and exact bounds: between surfaces, and within each surface of a body. Faces
/// with one common vertex intersect where one meets the opposite side of the other; faces with a common edge
/// where one lies on the other.
class IntersectionSearch {
 public:
    /// Call once, when all surfaces are there. distance: what is nearer at rest touches, metres. rules: which
    /// surfaces meet; what others have in common is no result.
    void begin(const std::vector<MovingSurface>& surfaces, double distance, const PairRules& rules = {});

    /// Faces of one body that intersect at rest, sorted.
    const std::vector<Intersection>& at_rest() const noexcept { return at_rest_; }
    /// These, those that touch without a common vertex, and all pairs of faces about them, sorted. Where a
    /// body is bent, sheets that cross at rest cross in others of these: faces are flat where the body
    /// between their corners is not.
    const std::vector<Intersection>& about_those_at_rest() const noexcept { return about_rest_; }

    /// Other faces that are no result of find() and missed_within().
    void leave_out(std::vector<Intersection> faces);

    /// All that are not about those at rest, sorted. Of surfaces with a HostProof without those that this
    /// excludes.
    std::vector<Intersection> find(std::vector<MovingSurface>& surfaces);

    /// Whether two surfaces of which the tree() of one can miss come within a distance, metres.
    bool missed_within(std::vector<MovingSurface>& surfaces, double distance);

 private:
    void find_at_rest(const std::vector<MovingSurface>& surfaces, int surface, double distance);
    std::span<const FacePair> open_pairs(MovingSurface& surface, float distance);
    std::vector<Intersection> keep_intersecting(const std::vector<MovingSurface>& surfaces) const;

    PairRules rules_;
    PairQuery pair_query_;
    SelfQuery self_query_;

    std::vector<Intersection> candidates_;
    std::vector<Intersection> at_rest_, touching_, about_rest_;
    std::vector<Intersection> left_out_;    // sorted
    std::vector<Intersection> neighbours_;  // faces with a common vertex, of surfaces without a HostProof
};

/// A line that names the first intersections and their number. Not empty.
std::string intersection_text(const std::vector<Intersection>& intersections,
                              const std::vector<MovingSurface>& surfaces);

}  // namespace nbd
