#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cstdint>
#include <memory>
#include <vector>

#include "collision/neighbours/rest_neighbours.hpp"

namespace nbd {

/// Proves of leaves of one body in a pose that their faces stay away from the faces around them, so that a
/// SelfQuery need not look at these. A quadratic map is fitted to the vertices around a leaf. How much it
/// shrinks distances follows from its coefficients, and how far the surface is from the map from its
/// edges: a proof that holds for any map. It succeeds unless the body is bent or squeezed much within a few
/// faces.
class NeighbourProof {
 public:
    /// Faces count as apart when their distance is more than `apart` + min(approach, relative motion of their
    /// vertices), and more than `inside`. Metres, >= 0.
    struct Reach {
        double apart = 0, approach = 0, inside = 0;
    };

    explicit NeighbourProof(std::shared_ptr<const RestNeighbours> rest);

    /// x: positions [n, 3], metres; motion: of the vertices, [n, 3], metres, or empty for none. Throws
    /// std::invalid_argument on another number of rows, and what the executor throws; nothing is proved then.
    /// Numbers that are not finite prove nothing.
    void prove(const Nodes& x, const Nodes& motion, const Reach& reach, const Executor& run = run_in_order);

    /// Bits of the faces of leaf `other` that are proved apart from every face of `leaf`, or need no proof.
    unsigned apart(int leaf, int other) const noexcept {
        return proved_[leaf] ? rest_->covered(leaf, other) : 0;
    }

    /// Faces that the last prove() says are apart are farther from each other than this, metres.
    double proved_distance() const noexcept { return std::max(reach_.apart, reach_.inside); }

    /// Number of leaves that have faces, and of those with a proof.
    int leaves() const noexcept;
    int proved() const noexcept;
    /// Largest motion of a vertex of one leaf relative to one of another in the last prove(), at most; 0
    /// without motion. Metres.
    double relative_motion(int leaf_a, int leaf_b) const noexcept;

    const WideTree& tree() const noexcept { return rest_->tree(); }
    /// The pairs that it takes for left out.
    const std::shared_ptr<const FacePairSet>& left_out() const noexcept { return rest_->left_out(); }

 private:
    bool is_proved(int leaf, const Nodes& x) const;

    std::shared_ptr<const RestNeighbours> rest_;
    Reach reach_;                               // of the last prove()
    std::vector<std::uint8_t> proved_;          // [leaves]
    std::vector<Eigen::AlignedBox3d> motions_;  // [leaves] boxes of their vertices' motions; empty: none
};

}  // namespace nbd
