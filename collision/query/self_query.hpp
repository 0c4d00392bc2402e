#pragma once

#include <memory>
#include <span>
#include <vector>

#include "collision/geometry/face_pair_set.hpp"
#include "collision/query/pair_query.hpp"

namespace nbd {

/// Queries of a posed tree with itself, for self-contact. Pairs of faces that share a vertex always touch;
/// they are left out during the walk, and so are further pairs that were given. The walk visits every pair of
/// nodes once. Faces that it finds are tested in batches, so that near faces never fill the memory. Bodies
/// with spheres are walked by exact boxes, see PosedTree::wide_tree().
///
/// Owns its scratch memory, which only grows; memory and errors are as in PairQuery. Use one object per
/// thread. Results stay valid until the next call on the same object.
class SelfQuery {
 public:
    SelfQuery() = default;
    /// left_out: further pairs of faces to leave out, for example near_at_rest(). Queries of a body whose
    /// surface has another number of faces throw std::invalid_argument.
    explicit SelfQuery(std::shared_ptr<const FacePairSet> left_out) : left_out_(std::move(left_out)) {}

    /// As PairQuery::reserve().
    void reserve(const PosedTree& body, std::size_t pairs);

    /// Pairs (a, b), a < b, of faces that have a point in common but no vertex, sorted, without repeats. This
    /// is the exact set, except that `learned_affine` bounds give a subset.
    std::span<const FacePair> intersecting(PosedTree& body);

    /// Likewise pairs at most `distance` apart (metres, finite, >= 0). Faces around one vertex are often
    /// nearer to each other than that: leave out near_at_rest() faces unless they matter.
    std::span<const FacePair> within(PosedTree& body, float distance);

    /// Pairs whose boxes come within `distance`: all pairs of within() and some more, in no order. These are
    /// all pairs of such boxes, except for `learned_affine` bounds. In a step, those of its boxes over the
    /// whole step: see PosedTree::begin_step().
    std::span<const FacePair> boxes_within(PosedTree& body, float distance);

    /// Likewise for a caller that knows of some pairs of leaves of the body's box tree which are near: of
    /// these, `known`, the query looks at `open` alone. Pairs are {a, b}, a <= b.
    std::span<const FacePair> boxes_within(PosedTree& body, float distance, const LeafPairSet& known,
                                           std::span<const LeafPair> open);

    /// Counters of the last query.
    const QueryCounters& counters() const noexcept { return counters_; }

 private:
    std::span<const FacePair> sorted_pairs();
    /// begin(tree): begins the walk.
    template <class Begin, class Narrow>
    std::span<const FacePair> find_face_pairs(PosedTree& body, float distance, const Begin& begin,
                                              const Narrow& narrow);
    template <class Narrow>
    std::span<const FacePair> find_face_pairs(PosedTree& body, float distance, const Narrow& narrow);
    /// Narrows the pairs of slots in `batch_` and moves them to `pairs_`, as faces.
    template <class Narrow>
    void finish_batch(const PosedWideTree& tree, const Narrow& narrow);

    std::shared_ptr<const FacePairSet> left_out_;
    QueryCounters counters_;
    WideWalk walk_;
    std::vector<FacePair> batch_, pairs_;
};

/// The pairs of faces that are at most `distance` apart in the rest pose and share no vertex. A SelfQuery
/// that leaves them out reports only faces that came near each other since. X: rest positions [n, 3];
/// F: faces [m, 3]; distance: metres, finite, >= 0. Throws std::invalid_argument as intersecting_faces(), and
/// on a distance out of range.
std::shared_ptr<const FacePairSet> near_at_rest(VerticesRef X, FacesRef F, float distance);

}  // namespace nbd
