#include "collision/nbd_tree/nbd_walk.hpp"

#include <algorithm>

namespace nbd {

void NbdWalk::count_held(const std::vector<NodePair>& pairs) noexcept {
    counters_.most_pairs = std::max(counters_.most_pairs, static_cast<long>(pairs.size()));
}

void NbdWalk::find_leaves(PosedNbdTree& a, PosedNbdTree& b, float distance) {
    counters_ = {};
    leaf_pairs_.clear();
    const auto walk = [&](const auto& sphere_a, const auto& sphere_b) {
        for (level_.assign(1, {0, 0}); !level_.empty(); std::swap(level_, next_)) {
            next_.clear();
            counters_.node_tests += level_.size();
            count_held(level_);
            for (const NodePair& pair : level_) {
                const SphereTree::Node &node_a = a.tree().nodes[pair.a], &node_b = b.tree().nodes[pair.b];
                const Sphere &s = sphere_a(pair.a), &t = sphere_b(pair.b);
                if (apart(s, t, distance)) continue;
                const bool first_is_larger = s.r >= t.r;
                if (node_a.is_leaf() && node_b.is_leaf()) {
                    leaf_pairs_.push_back(pair);
                } else if (node_b.is_leaf() || (!node_a.is_leaf() && first_is_larger)) {
                    next_.push_back({node_a.first_child, pair.b});
                    next_.push_back({node_a.first_child + 1, pair.b});
                } else {
                    next_.push_back({pair.a, node_b.first_child});
                    next_.push_back({pair.a, node_b.first_child + 1});
                }
            }
        }
    };
    a.with_spheres([&](const auto& sphere_a) {
        b.with_spheres([&](const auto& sphere_b) { walk(sphere_a, sphere_b); });
    });
    // The two were swapped, so the next walk may need either with the larger capacity.
    level_.reserve(next_.capacity());
    next_.reserve(level_.capacity());
    counters_.leaf_pairs = leaf_pairs_.size();
    count_held(leaf_pairs_);
}

void NbdWalk::walk_boxes(LeafBoxes& a, int root_a, LeafBoxes& b, int root_b, const Within& near,
                         std::vector<FacePair>& pairs) {
    a.open(root_a);
    b.open(root_b);
    stack_.assign(1, {root_a, root_b});
    while (!stack_.empty()) {
        count_held(stack_);
        const NodePair pair = stack_.back();
        stack_.pop_back();
        const LeafBoxes::Node &node_a = a.node(pair.a), &node_b = b.node(pair.b);
        const LeafBoxes::Opened& boxes_a = a.open(pair.a);
        const unsigned near_b = near_boxes(boxes_a, b.whole(pair.b), near);
        counters_.box_tests += node_a.count;
        if (near_b == 0) continue;
        const LeafBoxes::Opened& boxes_b = b.open(pair.b);
        unsigned any = 0;  // boxes of b that are near any box of a
        unsigned masks[LeafBoxes::max_boxes];
        near_boxes(boxes_b, boxes_a, near_b, near, masks);
        for_each_bit(near_b, [&](int i) {
            const unsigned mask = masks[i];
            counters_.box_tests += node_b.count;
            any |= mask;
            if (mask == 0 || (node_a.has_faces() && !node_b.has_faces())) return;
            if (node_b.has_faces() && !node_a.has_faces())
                stack_.push_back({node_a.first_child + i, pair.b});
            else if (node_b.has_faces())
                for_each_bit(mask, [&](int j) {
                    pairs.push_back({node_a.first_slot + i, node_b.first_slot + j});
                });
            else
                for_each_bit(mask, [&](int j) {
                    stack_.push_back({node_a.first_child + i, node_b.first_child + j});
                    a.prefetch_node(stack_.back().a);
                    b.prefetch_node(stack_.back().b);
                });
        });
        if (node_a.has_faces() && !node_b.has_faces())
            for_each_bit(any, [&](int j) { stack_.push_back({pair.a, node_b.first_child + j}); });
    }
}

void NbdWalk::near_faces(PosedNbdTree& s, PosedNbdTree& t, float distance, std::vector<FacePair>& pairs) {
    find_leaves(s, t, distance);
    LeafBoxes &a = s.leaves(), &b = t.leaves();
    const Within near(distance);
    const auto opened = [&] { return a.opened() + (&a == &b ? 0 : b.opened()); };
    const long opened_before = opened();
    for (std::size_t i = 0; i < leaf_pairs_.size(); ++i) {
        const auto in = [&](std::size_t ahead, const auto& prefetch) {
            if (i + ahead < leaf_pairs_.size()) prefetch(leaf_pairs_[i + ahead]);
        };
        in(2, [&](const LeafPair& pair) {
            a.prefetch_vertices(a.root(pair.a));
            b.prefetch_vertices(b.root(pair.b));
        });
        in(1, [&](const LeafPair& pair) {
            a.prefetch_positions(a.root(pair.a));
            b.prefetch_positions(b.root(pair.b));
        });
        walk_boxes(a, a.root(leaf_pairs_[i].a), b, b.root(leaf_pairs_[i].b), near, pairs);
    }
    counters_.boxes_refitted += opened() - opened_before;
}

}  // namespace nbd
