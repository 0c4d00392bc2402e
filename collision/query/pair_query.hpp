#pragma once

#include <span>
#include <vector>

#include "collision/base/counting_sort.hpp"
#include "collision/query/affine_walk.hpp"
#include "collision/tree/posed_tree.hpp"

namespace nbd {

/// Counters of one query.
struct QueryCounters {
    long nodes_bounded = 0;       // nodes bounded by this query, in both trees
    long nodes_out_of_range = 0;  // those bounded exactly because their input was out of the calibrated range
    long node_tests = 0;          // pairs of tree nodes compared
    long leaf_pairs = 0;          // leaf pairs whose bounds overlap
    long leaf_pairs_proved = 0;   // those of one body with itself whose faces a NeighbourProof left out
    long boxes_refitted = 0;      // nodes of the box trees under leaves, up to 32 boxes each
    long box_tests = 0;           // pairs of boxes under leaves compared
    long triangle_tests = 0;      // face pairs whose boxes are near
    long face_pairs = 0;          // reported
    long most_pairs = 0;          // pairs of one kind that the query held at a time, see PairQuery::reserve()
};

/// Queries between two posed trees by one walk down both sphere trees. The walk starts with the roots and
/// replaces the larger node of a colliding pair (or the one that is not a leaf) by its children. So a node is
/// bounded only after its parent was found in collision, and at most once per pose. Nodes are compared by
/// their boxes if both trees have bounds that are boxes, else by their spheres. Below colliding leaves the
/// walk continues with the boxes under them, down to triangles. No step loses a pair to rounding. Two bodies
/// with bounds of a box tree are walked down their box trees instead, see AffineWalk.
///
/// Owns its scratch memory, which only grows: a query allocates nothing unless it holds more pairs at a time
/// than any before it on this object (QueryCounters::most_pairs), or than reserve() made room for; nor do the
/// bodies, see PosedTree::reserve(). Where memory runs out, queries throw std::bad_alloc, and
/// std::invalid_argument on a distance out of range and where they read a position that is not finite; object
/// and bodies can be used again after either. Use one object per thread. Results stay valid until the next
/// call on the same object.
class PairQuery {
 public:
    /// Makes room for queries between these bodies that hold up to `pairs` pairs at a time. Queries that hold
    /// no more allocate nothing in this object, not even the first one.
    void reserve(const PosedTree& a, const PosedTree& b, std::size_t pairs);

    /// Face pairs that have a point in common, sorted by (a, b), without repeats. This is the exact set if
    /// both trees have `exact`, `boxes` or `affine` bounds. Learned bounds give a subset: a pair is missed if
    /// a node's bound misses it.
    std::span<const FacePair> intersecting(PosedTree& a, PosedTree& b);

    /// Face pairs at most `distance` apart (metres, finite, >= 0); order and exactness as in intersecting().
    std::span<const FacePair> within(PosedTree& a, PosedTree& b, float distance);

    /// All pairs of within() and some more whose boxes come within `distance`, found much faster, in no
    /// particular order, without repeats. Slabs of `affine` bounds leave out some of the latter. For bodies
    /// in a step, those of their boxes over the whole step: see PosedTree::begin_step(). Throws
    /// std::invalid_argument if one body is in a step and the other in a pose with bounds that are spheres.
    std::span<const FacePair> boxes_within(PosedTree& a, PosedTree& b, float distance);

    /// Leaves of the bodies' box trees, see PosedTree::box_tree(), whose boxes come within the reach of their
    /// blocks, which is `distance` at most; sorted. With that reach everywhere, all pairs of boxes_within()
    /// lie in these. Throws std::invalid_argument if a body has no box tree.
    std::span<const LeafPair> box_leaves_within(PosedTree& a, PosedTree& b, float distance,
                                                const BlockReach& reach);

    /// The broad phase alone: leaves of the bodies' sphere trees, as numbers of nodes, whose bounds come
    /// within `distance`, sorted.
    std::span<const LeafPair> leaf_pairs(PosedTree& a, PosedTree& b, float distance = 0);

    /// Counters of the last query.
    const QueryCounters& counters() const noexcept { return counters_; }

 private:
    /// Throws std::invalid_argument if a position that was read is not finite.
    void require_finite(const PosedTree& a, const PosedTree& b) const;
    /// Counts the pairs that are held now.
    template <class... Pairs>
    void count_held(const Pairs&... pairs) noexcept;
    void find_leaf_pairs(PosedTree& a, PosedTree& b, float distance);
    /// Walks the wide trees with walk(a, b), which sets the counters of the walk.
    template <class Walk>
    void walk_wide(PosedTree& a, PosedTree& b, const Walk& walk);
    template <class Narrow>
    std::span<const FacePair> find_face_pairs(PosedTree& a, PosedTree& b, float distance,
                                              const Narrow& narrow);
    template <class Narrow>
    std::span<const FacePair> find_sphere_tree_pairs(PosedTree& a, PosedTree& b, float distance,
                                                     const Narrow& narrow);
    template <class Narrow>
    std::span<const FacePair> find_wide_pairs(PosedTree& a, PosedTree& b, float distance,
                                              const Narrow& narrow);

    std::span<const FacePair> sorted_pairs();

    QueryCounters counters_;
    AffineWalk affine_walk_;
    std::vector<LeafPair> leaf_pairs_;
    CountingSort<LeafPair> counting_sort_;
    std::vector<NodePair> stack_, next_;
    std::vector<FacePair> pairs_;  // during a query: positions in the trees' `faces`
};

}  // namespace nbd
