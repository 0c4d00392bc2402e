#include "collision/nbd_tree/nbd_walk.hpp"

#include <algorithm>
#include <limits>

#include "collision/kernels/lane_mask.hpp"

namespace nbd {
namespace {

int face_count(const SphereTree::Node& node) noexcept { return node.face_end - node.face_begin; }

}  // namespace

void NbdWalk::count_held(const std::vector<NodePair>& pairs) noexcept {
    counters_.most_pairs = std::max(counters_.most_pairs, static_cast<long>(pairs.size()));
}

template <class Taken>
void NbdWalk::find_leaves(PosedNbdTree& a, PosedNbdTree& b, float distance) {
    counters_ = {};
    distance_ = distance;
    leaf_pairs_.clear();
    next_leaves_ = 0;
    const auto walk = [&](const auto& sphere_a, const auto& sphere_b) {
        for (level_.assign(1, {0, 0}); !level_.empty(); std::swap(level_, next_)) {
            next_.clear();
            counters_.node_tests += level_.size();
            count_held(level_);
            for (const NodePair& pair : level_) {
                const SphereTree::Node &node_a = a.tree().nodes[pair.a], &node_b = b.tree().nodes[pair.b];
                if (Taken::is_one_body && pair.a == pair.b) {  // near itself, whatever its sphere is
                    const int child = node_a.first_child;
                    if (node_a.is_leaf())
                        leaf_pairs_.push_back(pair);
                    else
                        next_.insert(next_.end(),
                                     {{child, child}, {child, child + 1}, {child + 1, child + 1}});
                    continue;
                }
                const Sphere &s = sphere_a(pair.a), &t = sphere_b(pair.b);
                if (apart(s, t, distance)) continue;
                const bool first_is_larger =
                    Taken::is_one_body ? face_count(node_a) >= face_count(node_b) : s.r >= t.r;
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

template <class Near, class Taken>
void NbdWalk::walk_boxes(LeafBoxes& a, int root_a, LeafBoxes& b, int root_b, const Near& near,
                         const Taken& taken, std::vector<FacePair>& pairs) {
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
                    if (taken.children(pair.a, pair.b, i, j) &&
                        taken.faces(node_a.first_slot + i, node_b.first_slot + j))
                        pairs.push_back({node_a.first_slot + i, node_b.first_slot + j});
                });
            else
                for_each_bit(mask, [&](int j) {
                    if (!taken.children(pair.a, pair.b, i, j)) return;
                    stack_.push_back({node_a.first_child + i, node_b.first_child + j});
                    a.prefetch_node(stack_.back().a);
                    b.prefetch_node(stack_.back().b);
                });
        });
        if (node_a.has_faces() && !node_b.has_faces())
            for_each_bit(any, [&](int j) { stack_.push_back({pair.a, node_b.first_child + j}); });
    }
}

template <class Near, class Taken>
void NbdWalk::find_faces(LeafBoxes& a, LeafBoxes& b, const Near& near, const Taken& taken, std::size_t enough,
                         std::vector<FacePair>& pairs) {
    const auto opened = [&] { return a.opened() + (&a == &b ? 0 : b.opened()); };
    const long opened_before = opened();
    for (std::size_t& i = next_leaves_; i < leaf_pairs_.size() && pairs.size() < enough; ++i) {
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
        walk_boxes(a, a.root(leaf_pairs_[i].a), b, b.root(leaf_pairs_[i].b), near, taken, pairs);
    }
    counters_.boxes_refitted += opened() - opened_before;
}

std::span<const LeafPair> NbdWalk::near_leaves(PosedNbdTree& a, PosedNbdTree& b, float distance) {
    find_leaves<TwoBodies>(a, b, distance);
    return leaf_pairs_;
}

void NbdWalk::near_faces(PosedNbdTree& a, PosedNbdTree& b, float distance, std::vector<FacePair>& pairs) {
    find_leaves<TwoBodies>(a, b, distance);
    constexpr std::size_t all = std::numeric_limits<std::size_t>::max();
    with_test(distance,
              [&](const auto& near) { find_faces(a.leaves(), b.leaves(), near, TwoBodies{}, all, pairs); });
}

void NbdWalk::begin_one_body(PosedNbdTree& body, float distance) {
    find_leaves<OneBody<LeafBoxes>>(body, body, distance);
}

bool NbdWalk::next_near_faces(PosedNbdTree& body, const LeftOut& left_out, std::size_t enough,
                              std::vector<FacePair>& pairs) {
    with_test(distance_, [&](const auto& near) {
        find_faces(body.leaves(), body.leaves(), near, OneBody(body.leaves(), left_out), enough, pairs);
    });
    return next_leaves_ < leaf_pairs_.size();
}

}  // namespace nbd
