#pragma once

#include <span>
#include <vector>

#include "collision/tree/posed_tree.hpp"

namespace nbd {

/// What a query did.
struct QueryCounters {
    long nodes_bounded = 0;       // spheres computed by this query, both trees
    long nodes_out_of_range = 0;  // of them exactly: their input was out of the calibrated range
    long node_tests = 0;          // pairs of tree nodes compared
    long leaf_pairs = 0;          // leaf pairs whose bounds overlap
    long boxes_refitted = 0;      // nodes of the trees under leaves, of up to 32 boxes each
    long box_tests = 0;
    long triangle_tests = 0;  // face pairs whose boxes are near
    long face_pairs = 0;      // reported
};

/// A node of each of two trees.
struct NodePair {
    int a = 0, b = 0;
    auto operator<=>(const NodePair&) const = default;
};
using LeafPair = NodePair;

/// Queries between two posed trees, by one walk down both sphere trees at once: it starts with the roots
/// and replaces the larger node of a pair that collides (or the one that is no leaf) by its children, so a
/// node is bounded only after its parent was found in collision, and at most once a pose. Where both are
/// `boxes`, nodes collide by these, else by their spheres. Leaves that collide go on with the boxes below
/// them, down to triangles. No step loses a pair to rounding.
///
/// Owns the scratch, so that a warm query allocates nothing. One object a thread. Results stay valid until
/// the next call on the same object.
class PairQuery {
 public:
    /// Face pairs that have a point in common, sorted by (a, b), without repeats. With `exact` bounds or
    /// `boxes` on both: the exact set. With learned bounds a subset of it: a pair is missed where a sphere
    /// misses it.
    std::span<const FacePair> intersecting(PosedTree& a, PosedTree& b) noexcept;

    /// Face pairs whose distance is at most `distance` (metres, finite, >= 0), likewise.
    std::span<const FacePair> within(PosedTree& a, PosedTree& b, float distance) noexcept;

    /// Face pairs whose boxes come within `distance`, likewise: all of within(), found much faster, and some
    /// more.
    std::span<const FacePair> boxes_within(PosedTree& a, PosedTree& b, float distance) noexcept;

    /// The broad phase alone: leaf pairs whose spheres come within `distance`, sorted.
    std::span<const LeafPair> leaf_pairs(PosedTree& a, PosedTree& b, float distance = 0) noexcept;

    /// What the last query did.
    const QueryCounters& counters() const noexcept { return counters_; }

 private:
    void find_leaf_pairs(PosedTree& a, PosedTree& b, float distance) noexcept;
    template <class Narrow>
    std::span<const FacePair> find_face_pairs(PosedTree& a, PosedTree& b, float distance,
                                              const Narrow& narrow) noexcept;

    QueryCounters counters_;
    std::vector<LeafPair> leaf_pairs_;
    std::vector<NodePair> stack_, next_;
    std::vector<FacePair> pairs_;  // on the way: positions in the trees' `faces`
};

}  // namespace nbd
