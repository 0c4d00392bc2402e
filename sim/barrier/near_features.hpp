#pragma once

#include <array>
#include <span>
#include <vector>

#include "collision/query/pair_query.hpp"
#include "collision/query/self_query.hpp"
#include "sim/barrier/intersections.hpp"
#include "sim/barrier/moving_surface.hpp"
#include "sim/barrier/neighbour_watch.hpp"
#include "sim/contact/pair_rules.hpp"
#include "sim/fem/step_report.hpp"

namespace nbd {

/// Finds the features that may come near: between surfaces, and within each surface of a body. Obstacles are
/// not compared with each other, nor with themselves.
///
/// Where a motion is close to the last one, the trees are asked for somewhat more than is near, so that the
/// next such motion, or a later part of it, takes a look at their answer alone. A surface with a HostProof is
/// asked for its own pairs each time: only of the leaves for which the proof fails.
class NearFeatureSearch {
 public:
    /// Call once, when all surfaces are there. touching: faces of one surface whose own features are never
    /// near, see IntersectionSearch::about_those_at_rest(); must stay valid. rules: which surfaces meet.
    void begin(const std::vector<MovingSurface>& surfaces, std::span<const Intersection> touching,
               const PairRules& rules = {});

    /// Other pairs that are never near.
    void leave_out(std::vector<FeaturePair> pairs);

    /// Has the trees asked anew by the next find(). What is found depends on that only where bounds can miss.
    void forget() { references_.clear(); }

    /// All pairs that MovingFeatures::may_press(), sorted: among them all that come within their reach.
    /// surfaces: those of begin(), moved. reach: metres. Valid until the next call.
    std::span<const NearFeatures> find(std::vector<MovingSurface>& surfaces, double reach);

    /// Pairs of faces looked at by the last find(), and the time of its queries.
    const StepReport& costs() const noexcept { return costs_; }

 private:
    /// A pair that the trees found, and how far apart it stayed by its approach in the motion asked for.
    struct Candidate {
        NearFeatures near;
        double apart = 0;
    };
    /// The motion of the points of a surface, [points, 3], that the trees were asked for.
    struct Reference {
        Nodes begin, way;
    };
    /// By how much points of a surface leave that motion: as they move, and about their mean.
    struct Deviation {
        double whole = 0, own = 0;
    };

    std::array<double, 2> shares(const std::vector<MovingSurface>& surfaces) const;
    Deviation deviation(std::size_t surface, const MovingSurface& moved,
                        const std::array<double, 2>& shares) const;
    double nearer(const FeaturePair& pair) const;
    double room_needed(const std::vector<MovingSurface>& surfaces, double reach);
    class MovingFaces;
    static Candidate candidate(const MovingFaces& faces, const FeaturePair& pair, const PlacesInFaces& places,
                               double reach, double room);
    static void collect(std::vector<MovingSurface>& surfaces, int a, int b, std::span<const FacePair> faces,
                        double reach, double room, std::vector<Candidate>& candidates);
    void ask_trees(std::vector<MovingSurface>& surfaces, double reach);
    void keep(std::span<const Candidate> candidates);
    void keep_near(const std::vector<MovingSurface>& surfaces);
    void keep_near_unproved(std::vector<MovingSurface>& surfaces, int surface, double reach);

    PairRules rules_;
    std::span<const Intersection> touching_;
    std::vector<FeaturePair> left_out_;  // sorted
    PairQuery pair_query_;
    SelfQuery self_query_;
    std::vector<NeighbourWatch> neighbours_;  // of the bodies' surfaces without a HostProof
    std::vector<Reference> references_;       // [surfaces]; empty: the trees were not asked
    double asked_reach_ = 0, room_ = 0;       // candidates have all that may approach to their sum
    std::vector<Candidate> candidates_, unproved_;
    std::vector<Deviation> deviations_;  // [surfaces]
    std::vector<NearFeatures> found_, kept_;
    std::vector<char> keeps_;  // [found_]
    std::vector<FacePair> faces_;
    StepReport costs_;
};

}  // namespace nbd
