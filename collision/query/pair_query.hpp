#pragma once

#include <span>
#include <vector>

#include "collision/base/counting_sort.hpp"
#include "collision/nbd_tree/nbd_walk.hpp"
#include "collision/tree/posed_tree.hpp"
#include "collision/wide_tree/wide_walk.hpp"

namespace nbd {

/// Throws std::invalid_argument unless the distance of a query, metres, is finite and >= 0.
void require_distance(float distance);

/// Queries between two posed trees by one walk down both: an NbdWalk where both bodies have an NBD-Tree, else
/// a WideWalk. No step loses a pair to rounding.
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
    /// a node's bound misses it. Spheres meet other bodies by exact boxes.
    std::span<const FacePair> intersecting(PosedTree& a, PosedTree& b);

    /// Face pairs at most `distance` apart (metres, finite, >= 0); order and exactness as in intersecting().
    std::span<const FacePair> within(PosedTree& a, PosedTree& b, float distance);

    /// All pairs of within() and some more whose boxes come within `distance`, found much faster, in no
    /// particular order, without repeats. Slabs of `affine` bounds leave out some of the latter. For bodies
    /// in a step, those of their boxes over the whole step: see PosedTree::begin_step().
    std::span<const FacePair> boxes_within(PosedTree& a, PosedTree& b, float distance);

    /// Leaves of the bodies' box trees, see PosedTree::box_tree(), whose boxes come within the reach of their
    /// blocks, which is `distance` at most; sorted. With that reach everywhere, all pairs of boxes_within()
    /// lie in these. Throws std::invalid_argument if a body has no box tree.
    std::span<const LeafPair> box_leaves_within(PosedTree& a, PosedTree& b, float distance,
                                                const BlockReach& reach);

    /// Counters of the last query.
    const QueryCounters& counters() const noexcept { return counters_; }

 private:
    /// Calls walk(s, t), which walks the two bodies' trees with `by`, and sets the counters.
    template <class Tree, class By, class Walk>
    void count(Tree& s, Tree& t, const By& by, const Walk& walk);
    template <class Tree, class By, class Narrow>
    void find_on_trees(Tree& s, Tree& t, By& by, float distance, const Narrow& narrow);
    template <class Narrow>
    std::span<const FacePair> find_face_pairs(PosedTree& a, PosedTree& b, float distance,
                                              const Narrow& narrow);
    std::span<const FacePair> sorted_pairs();

    QueryCounters counters_;
    NbdWalk nbd_walk_;
    WideWalk wide_walk_;
    std::vector<LeafPair> leaf_pairs_;
    CountingSort<LeafPair> counting_sort_;
    std::vector<FacePair> pairs_;  // during a query: slots
};

}  // namespace nbd
