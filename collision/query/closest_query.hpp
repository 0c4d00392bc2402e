#pragma once

#include <array>
#include <limits>
#include <optional>
#include <vector>

#include "collision/geometry/closest_points.hpp"
#include "collision/tree/posed_tree.hpp"

namespace nbd {

/// The closest faces of two bodies and their closest points.
struct ClosestFaces {
    FacePair faces;
    ClosestPoints points;  // of the two triangles, see closest_triangle_triangle()
};

/// Distances between two posed trees by branch and bound, on their trees of boxes: bodies with spheres have
/// exact ones, see PosedTree::wide_tree(). One queue holds pairs of nodes and of faces, ordered by a lower
/// bound on their distance. The search ends when no pair left can be closer than the closest faces found.
///
/// Owns its scratch memory, which only grows: a query allocates nothing unless it holds more candidates at a
/// time than any before it on this object, or than reserve() made room for. Errors are those of PairQuery.
/// Use one object per thread.
class ClosestQuery {
 public:
    /// The closest faces if they are at most `most` apart (metres, >= 0, else std::invalid_argument), or
    /// empty. Returns the first of equally close pairs, and any intersecting pair of bodies that intersect.
    /// Exact, except that `learned_affine` bounds may hide the closest faces; a pair further apart is then
    /// reported.
    std::optional<ClosestFaces> closest(PosedTree& a, PosedTree& b,
                                        double most = std::numeric_limits<double>::infinity());

    /// Makes room for so many candidates. See also PosedTree::reserve().
    void reserve(std::size_t candidates) { queue_.reserve(candidates); }
    /// Most candidates that the last query held at a time.
    std::size_t most_candidates() const noexcept { return most_candidates_; }

    /// Number of face pairs whose distance the last query computed.
    long triangle_tests() const noexcept { return triangle_tests_; }

 private:
    /// A pair of face slots, leaves, blocks or clusters, or a cluster and a body, with a lower bound on their
    /// distance, metres.
    struct Candidate {
        enum Level { faces, leaves, blocks, clusters, bodies };
        double distance;
        Level level;
        int a, b;
        auto operator<=>(const Candidate&) const = default;
    };

    void push(const Candidate& candidate);
    Candidate pop() noexcept;
    bool goes_on() const noexcept;
    void search(PosedWideTree& a, PosedWideTree& b);
    /// Replace a pair by the pairs of its parts.
    template <class Level>
    void open_children(Candidate::Level children, PosedWideTree& a, int node_a, PosedWideTree& b, int node_b);
    void open_leaves(PosedWideTree& a, int leaf_a, PosedWideTree& b, int leaf_b);
    void push_children(Candidate::Level level, const BoxPack& s, unsigned in_s, int first_a, const BoxPack& t,
                       unsigned in_t, int first_b, const Box& whole_t);
    /// Measures the faces in two slots.
    void measure(const PosedWideTree& a, int slot_a, const PosedWideTree& b, int slot_b) noexcept;

    std::vector<Candidate> queue_;
    double most_ = 0;                    // pairs further apart are ignored
    std::optional<FacePair> closest_;    // closest faces so far
    std::array<Triangle, 2> triangles_;  // triangles of `closest_`
    long triangle_tests_ = 0;
    std::size_t most_candidates_ = 0;
};

}  // namespace nbd
