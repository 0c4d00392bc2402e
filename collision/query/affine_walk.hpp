#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "collision/bounds/affine/affine_boxes.hpp"
#include "collision/geometry/geometry.hpp"
#include "collision/neighbours/face_pair_set.hpp"

namespace nbd {

class NeighbourProof;

/// Two nodes, one of each tree: numbers of nodes of sphere trees, or of one level of wide trees.
struct NodePair {
    int a = 0, b = 0;
    auto operator<=>(const NodePair&) const = default;
};
using LeafPair = NodePair;

/// How near leaves of a block of a and of one of b must come to count as near, metres, >= 0 and at most the
/// distance of the walk. Must not throw.
using BlockReach = std::function<float(int block_a, int block_b)>;

/// Likewise for faces of two leaves.
using LeafReach = std::function<float(int leaf_a, int leaf_b)>;

/// Counters of a walk.
struct AffineWalkCounters {
    long node_tests = 0;  // pairs of boxes of clusters, blocks and leaves compared, at most
    long leaf_pairs = 0;  // pairs of leaves whose boxes are near
    long proved = 0;      // those of them of which a proof left out all faces
    long box_tests = 0;   // pairs of boxes of faces compared, at most
    long most_pairs = 0;  // of one level that the walk held at a time, except of faces
};

/// Finds the faces of two bodies with wide trees, or of one body with itself, whose boxes are near each
/// other. Goes level by level, so that the data of later nodes can be prefetched. Owns its scratch memory.
class AffineWalk {
 public:
    /// Writes pairs of slots, in no order, to `pairs`. distance: metres; 0: boxes that have a point in
    /// common. No pair of faces within the distance is left out.
    void near_faces(AffineBoxes& a, AffineBoxes& b, float distance, std::vector<FacePair>& pairs);

    /// Pairs of leaves whose boxes are near, in no order; valid until the next walk. They hold the pairs of
    /// near_faces() of which the blocks are in reach.
    std::span<const LeafPair> near_leaves(AffineBoxes& a, AffineBoxes& b, float distance,
                                          const BlockReach& reach);

    /// Begins a walk over one body with itself, down to the leaves; next_near_faces() goes on, and the pose
    /// must stay the same until it returns false.
    void begin_one_body(AffineBoxes& body, float distance);
    /// Appends pairs of slots, each pair once, until there are `enough` or no more. Takes no pair of faces
    /// that share a vertex, nor of those left out or proved apart in this pose (null: none). reach: null: the
    /// walk's distance everywhere. Returns whether there may be more.
    bool next_near_faces(AffineBoxes& body, const FacePairSet* left_out, const NeighbourProof* proof,
                         const LeafReach* reach, std::size_t enough, std::vector<FacePair>& pairs);

    const AffineWalkCounters& counters() const noexcept { return counters_; }

    /// Makes room for walks over bodies with so many packs of clusters that hold up to `pairs` pairs at a
    /// time.
    void reserve(int packs, std::size_t pairs);

 private:
    /// Calls f with the test for boxes within distance_.
    template <class F>
    void with_test(const F& f) const;
    template <class Near, class Taken>
    void find_clusters(AffineBoxes& a, AffineBoxes& b, const Near& near, const Taken& taken);
    /// leaf_test(block_a, block_b): the test for leaves of these blocks.
    template <class Near, class Taken, class LeafTest>
    void find_leaves(AffineBoxes& a, AffineBoxes& b, const Near& near, const Taken& taken,
                     const LeafTest& leaf_test);
    /// face_test(leaf_a, leaf_b): the test for faces of these leaves.
    template <class Taken, class FaceTest>
    void find_faces(AffineBoxes& a, AffineBoxes& b, const Taken& taken, const FaceTest& face_test,
                    std::size_t enough, std::vector<FacePair>& pairs);
    /// Begins a walk. Returns whether the bodies may be near each other.
    bool begin(const AffineBoxes& a, const AffineBoxes& b, float distance);
    template <class Taken>
    void begin_leaves(AffineBoxes& a, AffineBoxes& b, float distance, const Taken& taken);

    float distance_ = 0;
    std::vector<std::uint16_t> near_a_, near_b_;  // a bit per cluster
    std::vector<NodePair> clusters_, blocks_, leaves_;
    std::size_t next_leaves_ = 0;  // the first pair of leaves whose faces were not looked at
    AffineWalkCounters counters_;
};

}  // namespace nbd
