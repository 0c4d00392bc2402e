#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "collision/bounds/walk.hpp"
#include "collision/nbd_tree/posed_nbd_tree.hpp"

namespace nbd {

/// Finds the faces of two bodies with NBD-Trees, or of one body with itself, that are near each other
/// [JamesPai04]. Starts with the roots and replaces the larger node of a colliding pair, or the one that is
/// not a leaf, by its children. So a node is bounded only after its parent was found in collision, and at
/// most once per pose. Below colliding leaves it goes on with the boxes under them, down to faces. Owns its
/// scratch memory.
class NbdWalk {
 public:
    /// Pairs of leaves, as numbers of nodes, whose spheres come within `distance`; valid until the next walk.
    std::span<const LeafPair> near_leaves(PosedNbdTree& a, PosedNbdTree& b, float distance);

    /// Appends pairs of slots of faces whose leaves and boxes are near each other, in no order. distance:
    /// metres; 0: boxes that have a point in common.
    void near_faces(PosedNbdTree& a, PosedNbdTree& b, float distance, std::vector<FacePair>& pairs);

    /// Begins a walk over one body with itself, down to the leaves; next_near_faces() goes on, and the pose
    /// must stay the same until it returns false.
    void begin_one_body(PosedNbdTree& body, float distance);
    /// Appends pairs of slots, each pair once, until there are `enough` or no more. Returns whether there may
    /// be more.
    bool next_near_faces(PosedNbdTree& body, const LeftOut& left_out, std::size_t enough,
                         std::vector<FacePair>& pairs);

    /// Of the last walk: all but what posed trees count and what becomes of the pairs.
    const QueryCounters& counters() const noexcept { return counters_; }

    /// Makes room for walks that hold up to `pairs` pairs at a time.
    void reserve(std::size_t pairs) {
        for (auto* held : {&leaf_pairs_, &level_, &next_, &stack_}) held->reserve(pairs);
    }

 private:
    /// Taken: TwoBodies or OneBody.
    template <class Taken>
    void find_leaves(PosedNbdTree& a, PosedNbdTree& b, float distance);
    template <class Near, class Taken>
    void find_faces(LeafBoxes& a, LeafBoxes& b, const Near& near, const Taken& taken, std::size_t enough,
                    std::vector<FacePair>& pairs);
    /// Walks over the boxes under a pair of leaves.
    template <class Near, class Taken>
    void walk_boxes(LeafBoxes& a, int root_a, LeafBoxes& b, int root_b, const Near& near, const Taken& taken,
                    std::vector<FacePair>& pairs);
    void count_held(const std::vector<NodePair>& pairs) noexcept;

    float distance_ = 0;
    std::vector<NodePair> level_, next_;  // pairs of nodes of a level
    std::vector<NodePair> stack_;         // pairs of nodes of boxes
    std::vector<LeafPair> leaf_pairs_;
    std::size_t next_leaves_ = 0;  // the first pair of leaves whose faces were not looked at
    QueryCounters counters_;
};

}  // namespace nbd
