#include "collision/query/pair_query.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "collision/base/message.hpp"
#include "collision/query/narrow_phase.hpp"

namespace nbd {

void require_distance(float distance) {
    if (!(distance >= 0 && std::isfinite(distance)))
        throw std::invalid_argument(message("distance is ", distance, " m, allowed: finite, 0 or more"));
}

void PairQuery::reserve(const PosedTree& a, const PosedTree& b, std::size_t pairs) {
    const PosedTree::WideRoom room_a = a.wide_room(), room_b = b.wide_room();
    wide_walk_.reserve(std::max(room_a.packs, room_b.packs), pairs);
    nbd_walk_.reserve(pairs);
    counting_sort_.reserve(pairs, std::max(room_a.leaves, room_b.leaves));
    leaf_pairs_.reserve(pairs);
    pairs_.reserve(pairs);
}

template <class Tree, class By, class Walk>
void PairQuery::count(Tree& s, Tree& t, const By& by, const Walk& walk) {
    const auto of_both = [&](auto number) { return (s.*number)() + (&s == &t ? 0 : (t.*number)()); };
    const int bounded_before = of_both(&Tree::bounded), out_of_range_before = of_both(&Tree::out_of_range);
    walk(s, t);
    counters_ = by.counters();
    counters_.nodes_bounded = of_both(&Tree::bounded) - bounded_before;
    counters_.nodes_out_of_range = of_both(&Tree::out_of_range) - out_of_range_before;
    s.require_finite();
    t.require_finite();
}

template <class Tree, class By, class Narrow>
void PairQuery::find_on_trees(Tree& s, Tree& t, By& by, float distance, const Narrow& narrow) {
    count(s, t, by, [&](Tree&, Tree&) { by.near_faces(s, t, distance, pairs_); });
    const auto near = static_cast<long>(pairs_.size());
    counters_.triangle_tests = near;
    counters_.most_pairs = std::max(counters_.most_pairs, near);
    narrow(pairs_, s.faces(), t.faces());
    for (FacePair& pair : pairs_) pair = {s.face(pair.a), t.face(pair.b)};
    counters_.face_pairs = pairs_.size();
}

template <class Narrow>
std::span<const FacePair> PairQuery::find_face_pairs(PosedTree& a, PosedTree& b, float distance,
                                                     const Narrow& narrow) {
    require_distance(distance);
    counters_ = {};
    pairs_.clear();
    if (!a.has_pose() || !b.has_pose()) return pairs_;
    if (a.nbd_tree() && b.nbd_tree())
        find_on_trees(*a.nbd_tree(), *b.nbd_tree(), nbd_walk_, distance, narrow);
    else
        find_on_trees(a.wide_tree(), b.wide_tree(), wide_walk_, distance, narrow);
    return pairs_;
}

/// Every face belongs to one leaf, so no pair occurs twice.
std::span<const FacePair> PairQuery::sorted_pairs() {
    std::ranges::sort(pairs_);
    return pairs_;
}

std::span<const FacePair> PairQuery::intersecting(PosedTree& a, PosedTree& b) {
    find_face_pairs(a, b, 0, [](std::vector<FacePair>& pairs, const auto& in_a, const auto& in_b) {
        keep_intersecting(pairs, in_a, in_b);
    });
    return sorted_pairs();
}

std::span<const FacePair> PairQuery::within(PosedTree& a, PosedTree& b, float distance) {
    find_face_pairs(a, b, distance, [&](std::vector<FacePair>& pairs, const auto& in_a, const auto& in_b) {
        keep_within(pairs, in_a, in_b, distance);
    });
    return sorted_pairs();
}

std::span<const FacePair> PairQuery::boxes_within(PosedTree& a, PosedTree& b, float distance) {
    return find_face_pairs(a, b, distance, [](std::vector<FacePair>&, const auto&, const auto&) {});
}

std::span<const LeafPair> PairQuery::box_leaves_within(PosedTree& a, PosedTree& b, float distance,
                                                       const BlockReach& reach) {
    require_distance(distance);
    for (const PosedTree* body : {&a, &b})
        if (!body->box_tree())
            throw std::invalid_argument(message("leaves of box trees of a body with ", name(body->kind()),
                                                " bounds; allowed: boxes, affine, learned_affine"));
    count(a.wide_tree(), b.wide_tree(), wide_walk_, [&](PosedWideTree& s, PosedWideTree& t) {
        const std::span<const LeafPair> found = wide_walk_.near_leaves(s, t, distance, reach);
        leaf_pairs_.assign(found.begin(), found.end());
    });
    counting_sort_.sort(leaf_pairs_, b.box_tree()->leaves(), [](const LeafPair& pair) { return pair.b; });
    counting_sort_.sort(leaf_pairs_, a.box_tree()->leaves(), [](const LeafPair& pair) { return pair.a; });
    return leaf_pairs_;
}

}  // namespace nbd
