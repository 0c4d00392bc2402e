#pragma once

#include <algorithm>
#include <vector>

#include "collision/kernels/lane_mask.hpp"
#include "collision/query/near_boxes.hpp"
#include "collision/query/pair_query.hpp"
#include "collision/tree/leaf_boxes.hpp"

namespace nbd {

/// Walks over the boxes under a pair of leaves and finds all pairs of faces with near boxes. near:
/// Overlapping or Within. taken: TwoBodies or OneBody. stack: scratch. near_faces: appended, pairs of slots.
template <class Near, class Taken>
void walk_boxes(LeafBoxes& a, int root_a, LeafBoxes& b, int root_b, const Near& near, const Taken& taken,
                std::vector<NodePair>& stack, std::vector<FacePair>& near_faces, QueryCounters& counters) {
    a.open(root_a);
    b.open(root_b);
    stack.assign(1, {root_a, root_b});
    while (!stack.empty()) {
        counters.most_pairs = std::max(counters.most_pairs, static_cast<long>(stack.size()));
        const NodePair pair = stack.back();
        stack.pop_back();
        const LeafBoxes::Node &node_a = a.node(pair.a), &node_b = b.node(pair.b);
        const LeafBoxes::Opened& boxes_a = a.open(pair.a);
        const unsigned near_b = near_boxes(boxes_a, b.whole(pair.b), near);
        counters.box_tests += node_a.count;
        if (near_b == 0) continue;
        const LeafBoxes::Opened& boxes_b = b.open(pair.b);
        unsigned any = 0;  // boxes of b that are near any box of a
        unsigned masks[LeafBoxes::max_boxes];
        near_boxes(boxes_b, boxes_a, near_b, near, masks);
        for_each_bit(near_b, [&](int i) {
            const unsigned mask = masks[i];
            counters.box_tests += node_b.count;
            any |= mask;
            if (mask == 0 || (node_a.has_faces() && !node_b.has_faces())) return;
            if (node_b.has_faces() && !node_a.has_faces())
                stack.push_back({node_a.first_child + i, pair.b});
            else if (node_b.has_faces())
                for_each_bit(mask, [&](int j) {
                    if (taken.children(pair.a, pair.b, i, j) &&
                        taken.faces(node_a.first_slot + i, node_b.first_slot + j))
                        near_faces.push_back({node_a.first_slot + i, node_b.first_slot + j});
                });
            else
                for_each_bit(mask, [&](int j) {
                    if (!taken.children(pair.a, pair.b, i, j)) return;
                    stack.push_back({node_a.first_child + i, node_b.first_child + j});
                    a.prefetch_node(stack.back().a);
                    b.prefetch_node(stack.back().b);
                });
        });
        if (node_a.has_faces() && !node_b.has_faces())
            for_each_bit(any, [&](int j) { stack.push_back({pair.a, node_b.first_child + j}); });
    }
}

}  // namespace nbd
