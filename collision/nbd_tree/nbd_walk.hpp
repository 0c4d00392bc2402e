#pragma once

#include <cstddef>
#include <vector>

#include "collision/bounds/walk.hpp"
#include "collision/nbd_tree/posed_nbd_tree.hpp"

namespace nbd {

/// Finds the faces of two bodies with NBD-Trees that are near each other [JamesPai04]. Starts with the roots
/// and replaces the larger node of a colliding pair, or the one that is not a leaf, by its children. So a
/// node is bounded only after its parent was found in collision, and at most once per pose. Below colliding
/// leaves it goes on with the boxes under them, down to faces. Owns its scratch memory.
class NbdWalk {
 public:
    /// Appends pairs of slots of faces whose leaves and boxes are near each other, in no order. distance:
    /// metres; 0: boxes that have a point in common.
    void near_faces(PosedNbdTree& a, PosedNbdTree& b, float distance, std::vector<FacePair>& pairs);

    /// Of the last walk: all but what posed trees count and what becomes of the pairs.
    const QueryCounters& counters() const noexcept { return counters_; }

    /// Makes room for walks that hold up to `pairs` pairs at a time.
    void reserve(std::size_t pairs) {
        for (auto* held : {&leaf_pairs_, &level_, &next_, &stack_}) held->reserve(pairs);
    }

 private:
    /// Lists the pairs of leaves, as numbers of nodes, whose spheres come within `distance`.
    void find_leaves(PosedNbdTree& a, PosedNbdTree& b, float distance);
    /// Walks over the boxes under a pair of leaves.
    void walk_boxes(LeafBoxes& a, int root_a, LeafBoxes& b, int root_b, const Within& near,
                    std::vector<FacePair>& pairs);
    void count_held(const std::vector<NodePair>& pairs) noexcept;

    std::vector<NodePair> level_, next_;  // pairs of nodes of a level
    std::vector<NodePair> stack_;         // pairs of nodes of boxes
    std::vector<LeafPair> leaf_pairs_;
    QueryCounters counters_;
};

}  // namespace nbd
