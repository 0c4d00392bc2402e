#pragma once

#include <optional>
#include <span>
#include <vector>

#include "collision/continuous/moving_body.hpp"
#include "collision/query/pair_query.hpp"
#include "collision/query/self_query.hpp"

namespace nbd {

/// How much of a step is free of collisions.
struct FreeStep {
    double share = 1;                  // of the step, in [0, 1]
    std::optional<FeaturePair> limit;  // the pair that ends it; none if all of the step is free
    double gap = 0;                    // distance of that pair at the begin of the step
    bool exhausted = false;            // its search ran out of iterations: it may not collide, see Impact
};

/// Which features of bodies may meet in a step, and how much of the step they may take. Surfaces are numbered
/// as they stand in the list of bodies.
///
/// Owns its scratch memory, which only grows. Results stay valid until the next call on the same object. Use
/// one object per thread; it writes into the bodies.
class FeatureQuery {
 public:
    /// Pairs of a vertex and a face, and of two edges, whose boxes over the whole step come within
    /// `distance`: none that does so itself at any time of the step is left out. They have no vertex in
    /// common; pairs of one body, relative to its mean motion, are found between all of its faces, also those
    /// that share a vertex. Sorted, without repeats; of two edges of one body the smaller stands first.
    /// distance: finite, >= 0, in the unit of the positions; boxes farther apart by 2e-15 of the size of
    /// the whole are taken for near, too.
    /// Throws std::invalid_argument on a distance out of range.
    std::span<const FeaturePair> candidates(std::span<MovingBody> bodies, double distance);

    /// The share of the step up to which all features of candidates() stay farther apart than `separation`,
    /// and those that would come nearer later in the step keep a share `left` of what their distance at the
    /// begin has above it. A pair that is not farther apart than `separation` at the begin ends the step at
    /// share 0, wherever it moves.
    /// separation: finite, >= 0; left: 0 <= left < 1. Throws std::invalid_argument if out of range.
    FreeStep collision_free_step(std::span<MovingBody> bodies, double separation, double left = 0.1);

 private:
    void find(std::span<MovingBody> bodies, int body, double distance);
    void find(std::span<MovingBody> bodies, int a, int b, double distance);
    void keep_near(std::size_t first, const MovingBody& s, const MovingBody::Local& local_s,
                   const MovingBody& t, const MovingBody::Local& local_t, double distance);

    PairQuery pair_query_;
    SelfQuery self_query_;
    std::vector<FeaturePair> pairs_;
};

}  // namespace nbd
