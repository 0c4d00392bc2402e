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
    long boxes_refitted = 0;      // nodes of the box trees under leaves, up to 32 boxes each
    long box_tests = 0;           // pairs of boxes under leaves compared
    long triangle_tests = 0;      // face pairs whose boxes are near
    long face_pairs = 0;          // reported
};

/// Queries between two posed trees by one walk down both sphere trees. The walk starts with the roots and
/// replaces the larger node of a colliding pair (or the one that is not a leaf) by its children. So a node is
/// bounded only after its parent was found in collision, and at most once per pose. Nodes are compared by
/// their boxes if both trees have bounds that are boxes, else by their spheres. Below colliding leaves the
/// walk continues with the boxes under them, down to triangles. No step loses a pair to rounding. Two bodies
/// with `affine` bounds or `boxes` are walked down their box trees instead, see AffineWalk. Two with `auto`
/// bounds are walked in both ways while these are measured, see AutoChoice; the answer is then exact.
///
/// Owns its scratch memory, so a warm query allocates nothing. Use one object per thread. Results stay valid
/// until the next call on the same object.
class PairQuery {
 public:
    /// Face pairs that have a point in common, sorted by (a, b), without repeats. This is the exact set if
    /// both trees have `exact`, `boxes` or `affine` bounds. Learned bounds give a subset: a pair is missed if
    /// a node's bound misses it.
    std::span<const FacePair> intersecting(PosedTree& a, PosedTree& b) noexcept;

    /// Face pairs at most `distance` apart (metres, finite, >= 0); order and exactness as in intersecting().
    std::span<const FacePair> within(PosedTree& a, PosedTree& b, float distance) noexcept;

    /// Face pairs whose boxes come within `distance`: all pairs of within() and some more, found much faster,
    /// in no particular order, without repeats. For bodies in a step, those of their boxes over the whole
    /// step: see PosedTree::begin_step().
    std::span<const FacePair> boxes_within(PosedTree& a, PosedTree& b, float distance) noexcept;

    /// Leaves of the bodies' box trees, see PosedTree::box_tree(), whose boxes come within the reach of their
    /// blocks, which is `distance` at most; sorted. With that reach everywhere, all pairs of boxes_within()
    /// lie in these. Both bodies must have a box tree.
    std::span<const LeafPair> box_leaves_within(PosedTree& a, PosedTree& b, float distance,
                                                const BlockReach& reach) noexcept;

    /// The broad phase alone: leaf pairs whose bounds come within `distance`, sorted.
    std::span<const LeafPair> leaf_pairs(PosedTree& a, PosedTree& b, float distance = 0) noexcept;

    /// Counters of the last query.
    const QueryCounters& counters() const noexcept { return counters_; }

 private:
    void find_leaf_pairs(PosedTree& a, PosedTree& b, float distance) noexcept;
    /// Walks the wide trees with walk(a, b), which sets the counters of the walk.
    template <class Walk>
    void walk_wide(PosedTree& a, PosedTree& b, const Walk& walk) noexcept;
    template <class Narrow>
    std::span<const FacePair> find_face_pairs(PosedTree& a, PosedTree& b, float distance,
                                              const Narrow& narrow) noexcept;
    template <class Narrow>
    std::span<const FacePair> find_sphere_tree_pairs(PosedTree& a, PosedTree& b, float distance,
                                                     const Narrow& narrow) noexcept;
    template <class Narrow>
    std::span<const FacePair> find_wide_pairs(PosedTree& a, PosedTree& b, float distance,
                                              const Narrow& narrow) noexcept;

    std::span<const FacePair> sorted_pairs() noexcept;

    QueryCounters counters_;
    AffineWalk affine_walk_;
    std::vector<LeafPair> leaf_pairs_;
    CountingSort<LeafPair> counting_sort_;
    std::vector<NodePair> stack_, next_;
    std::vector<FacePair> pairs_;  // during a query: positions in the trees' `faces`
};

}  // namespace nbd
