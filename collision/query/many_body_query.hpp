#pragma once

#include <functional>
#include <span>
#include <vector>

#include "collision/base/executor.hpp"
#include "collision/query/pair_query.hpp"
#include "collision/query/sweep.hpp"

namespace nbd {

/// Two bodies of a list that touch, and where.
struct TouchingBodies {
    BodyIndices bodies;
    std::span<const FacePair> faces;  // not empty
};

/// Queries between all bodies of a list: a sweep over the roots' bounds finds pairs of bodies, a PairQuery
/// their faces. A body is bounded once a pose for all its pairs, since what a PosedTree computes it keeps.
///
/// That a tree is written when it is read is also what limits pairs that run at once: they are dealt out in
/// rounds in which no body has two of them. So answers do not depend on threads, and one body that touches n
/// others takes n rounds.
///
/// Owns the scratch, so that a warm query allocates nothing. Results stay valid until the next call on the
/// same object.
class ManyBodyQuery {
 public:
    explicit ManyBodyQuery(Executor executor = run_in_order) : executor_(std::move(executor)) {}

    /// As PairQuery of the same names, for every two of the bodies, a < b, in ascending order. bodies: no
    /// tree twice, and with an executor that has threads no two that share EmbeddedPositions. Throws what the
    /// executor throws.
    std::span<const TouchingBodies> intersecting(std::span<PosedTree* const> bodies);
    std::span<const TouchingBodies> within(std::span<PosedTree* const> bodies, float distance);

    /// Pairs of bodies that the last query asked for their faces, and the rounds that it took.
    int pairs_asked() const noexcept { return static_cast<int>(pairs_.size()); }
    int rounds() const noexcept { return static_cast<int>(round_ends_.size()); }

 private:
    template <class Ask>
    std::span<const TouchingBodies> run(std::span<PosedTree* const> bodies, float distance, const Ask& ask);
    void deal_out(std::size_t bodies);

    Executor executor_;
    Sweep sweep_;
    std::vector<Box> roots_;                 // [bodies]
    std::span<const BodyIndices> pairs_;     // that the sweep found
    std::vector<int> order_, round_ends_;    // pairs, those of a round together; where in it the rounds end
    std::vector<int> waiting_, last_round_;  // pairs without a round; [bodies]
    std::vector<PairQuery> queries_;         // one a pair
    std::vector<TouchingBodies> answers_;    // [pairs], then those that touch
};

}  // namespace nbd
