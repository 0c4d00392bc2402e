#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "collision/bounds/walk.hpp"
#include "collision/geometry/face_pair_set.hpp"
#include "collision/wide_tree/posed_wide_tree.hpp"

namespace nbd {

/// The clusters of a wide tree, whose children are blocks, and the blocks, whose children are leaves.
struct ClusterLevel {
    static Box box(const PosedWideTree& body, int i) noexcept { return body.cluster(i); }
    static const PosedWideTree::Children& children(PosedWideTree& body, int i) { return body.blocks(i); }
    static unsigned present(const PosedWideTree& body, int i) noexcept { return body.present_blocks(i); }
    static int first_child(const PosedWideTree& body, int i) noexcept { return body.first_block(i); }
    static void prefetch(const PosedWideTree& body, int i) noexcept { body.prefetch_cluster(i); }
};
struct BlockLevel {
    static Box box(const PosedWideTree& body, int i) noexcept { return body.block(i); }
    static const PosedWideTree::Children& children(PosedWideTree& body, int i) { return body.leaves(i); }
    static unsigned present(const PosedWideTree& body, int i) noexcept { return body.present_leaves(i); }
    static int first_child(const PosedWideTree&, int i) noexcept { return tree_width * i; }
    static void prefetch(const PosedWideTree& body, int i) noexcept { body.prefetch_block(i); }
};

/// How near leaves of a block of a and of one of b must come to count as near, metres, >= 0 and at most the
/// distance of the walk. Must not throw.
using BlockReach = std::function<float(int block_a, int block_b)>;

/// Pairs of leaves of one wide tree.
class LeafPairSet {
 public:
    LeafPairSet() = default;
    /// blocks: of the tree. pairs: a <= b.
    LeafPairSet(int blocks, std::span<const LeafPair> pairs);

    /// Removes the pairs that are in this set. pairs: a <= b; fast where neighbours are of the same blocks.
    void remove_from(std::vector<LeafPair>& pairs) const;

 private:
    using Mask = std::array<std::uint16_t, tree_width>;  // a bit per leaf of the second block
    const Mask* find(int block_a, int block_b) const noexcept;

    std::vector<int> begin_;   // [blocks + 1]
    std::vector<int> others_;  // second blocks of each block, ascending
    std::vector<Mask> masks_;  // [others_]
};

/// Finds the faces of two bodies with wide trees, or of one body with itself, whose boxes are near each
/// other. Goes level by level, so that the data of later nodes can be prefetched. Owns its scratch memory.
class WideWalk {
 public:
    /// Appends pairs of slots, in no order. distance: metres; 0: boxes that have a point in common. No pair
    /// of faces within the distance is left out.
    void near_faces(PosedWideTree& a, PosedWideTree& b, float distance, std::vector<FacePair>& pairs);

    /// Pairs of leaves whose boxes are near, in no order; valid until the next walk. They hold the pairs of
    /// near_faces() of which the blocks are in reach.
    std::span<const LeafPair> near_leaves(PosedWideTree& a, PosedWideTree& b, float distance,
                                          const BlockReach& reach);

    /// Begins a walk over one body with itself, down to the leaves; next_near_faces() goes on, and the pose
    /// must stay the same until it returns false.
    void begin_one_body(PosedWideTree& body, float distance);
    /// Likewise, but of the pairs of leaves in `known`, looks at `open` alone.
    void begin_one_body(PosedWideTree& body, float distance, const LeafPairSet& known,
                        std::span<const LeafPair> open);
    /// Appends pairs of slots, each pair once, until there are `enough` or no more, without faces that share
    /// a vertex or are in left_out (null: none). Returns whether there may be more.
    bool next_near_faces(PosedWideTree& body, const FacePairSet* left_out, std::size_t enough,
                         std::vector<FacePair>& pairs);

    /// Of the last walk: all but what posed trees count and what becomes of the pairs.
    const QueryCounters& counters() const noexcept { return counters_; }

    /// Makes room for walks over bodies with so many packs of clusters that hold up to `pairs` pairs at a
    /// time.
    void reserve(int packs, std::size_t pairs);

 private:
    template <class Taken>
    void find_clusters(PosedWideTree& a, PosedWideTree& b, const Within& near, const Taken& taken);
    /// leaf_test(block_a, block_b): the test for leaves of these blocks.
    template <class Taken, class LeafTest>
    void find_leaves(PosedWideTree& a, PosedWideTree& b, const Within& near, const Taken& taken,
                     const LeafTest& leaf_test);
    template <class Taken>
    void find_faces(PosedWideTree& a, PosedWideTree& b, const Taken& taken, std::size_t enough,
                    std::vector<FacePair>& pairs);
    /// Begins a walk. Returns whether the bodies may be near each other.
    bool begin(const PosedWideTree& a, const PosedWideTree& b, float distance);
    template <class Taken>
    void begin_leaves(PosedWideTree& a, PosedWideTree& b, float distance, const Taken& taken);

    float distance_ = 0;
    std::vector<std::uint16_t> near_a_, near_b_;  // a bit per cluster
    std::vector<NodePair> clusters_, blocks_, leaves_;
    std::size_t next_leaves_ = 0;  // the first pair of leaves whose faces were not looked at
    QueryCounters counters_;
};

}  // namespace nbd
