#pragma once

#include <exception>
#include <functional>
#include <span>
#include <vector>

#include "collision/base/executor.hpp"
#include "collision/query/pair_query.hpp"
#include "collision/query/sweep.hpp"

namespace nbd {

/// Two bodies of a list that touch, and their face pairs.
struct TouchingBodies {
    BodyIndices bodies;
    std::span<const FacePair> faces;  // not empty
};

/// Queries between all bodies of a list: a sweep over the roots' bounds finds pairs of bodies, a PairQuery
/// finds their face pairs. A PosedTree caches its nodes, so each is bounded once per pose for all pairs.
/// Where one of the bodies has boxes, the roots of all are boxes.
///
/// Reading a tree writes its caches, so pairs that share a body must not run at the same time. They run in
/// rounds in which no body has two pairs: answers do not depend on threads, and a body that touches n others
/// takes n rounds.
///
/// Owns its scratch memory, which only grows: a query allocates nothing unless more bodies or pairs of bodies
/// are near than in any query before it, or one of the pairs holds more than reserve() made room for, see
/// PairQuery. Results stay valid until the next call on the same object.
class ManyBodyQuery {
 public:
    explicit ManyBodyQuery(Executor executor = run_in_order) : executor_(std::move(executor)) {}

    /// Like the functions of PairQuery, for all pairs of bodies a < b, in ascending order. bodies: no tree
    /// twice. Throws what the executor throws, and the errors of PairQuery, of several the one of the first
    /// body or pair.
    std::span<const TouchingBodies> intersecting(std::span<PosedTree* const> bodies);
    std::span<const TouchingBodies> within(std::span<PosedTree* const> bodies, float distance);
    std::span<const TouchingBodies> boxes_within(std::span<PosedTree* const> bodies, float distance);

    /// Makes room for queries in which up to `body_pairs` pairs of these bodies are near each other, each of
    /// them as in PairQuery::reserve().
    void reserve(std::span<PosedTree* const> bodies, std::size_t body_pairs, std::size_t pairs);

    /// Number of body pairs that the last query tested for face pairs, and its number of rounds.
    int pairs_asked() const noexcept { return pairs_.size(); }
    int rounds() const noexcept { return static_cast<int>(round_ends_.size()); }

 private:
    template <class Ask>
    std::span<const TouchingBodies> run(std::span<PosedTree* const> bodies, float distance, const Ask& ask);
    void deal_out(std::size_t bodies);
    /// Runs task(0) to task(count - 1) and passes on the first one's error: threads of an executor may not
    /// throw.
    template <class Task>
    void run_tasks(int count, const Task& task);

    Executor executor_;
    Sweep sweep_;
    std::vector<Box> roots_;                  // [bodies]
    std::span<const BodyIndices> pairs_;      // pairs found by the sweep
    std::vector<int> order_, round_ends_;     // pairs grouped by round; end of each round in `order_`
    std::vector<int> waiting_, last_round_;   // pairs without a round; [bodies] last round of each body
    std::vector<PairQuery> queries_;          // one per pair
    std::vector<std::exception_ptr> errors_;  // one per task
    std::vector<TouchingBodies> answers_;     // [pairs], finally only pairs that touch
};

}  // namespace nbd
