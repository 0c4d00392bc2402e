#include "collision/query/pair_query.hpp"

#include <algorithm>
#include <stdexcept>

#include "collision/geometry/separation.hpp"
#include "collision/query/box_walk.hpp"
#include "collision/query/keep_intersecting.hpp"
#include "collision/query/keep_within.hpp"
#include "collision/query/one_body.hpp"
#include "collision/query/require_distance.hpp"
#include "collision/tree/posed_tree_state.hpp"

namespace nbd {
namespace {

int face_count(const SphereTree::Node& node) noexcept { return node.face_end - node.face_begin; }

/// PairQuery's walk over the sphere trees, level by level, for one pair of bound types. level, next: scratch.
template <Bound A, Bound B>
void walk_nodes(const SphereTree& tree_a, PosedSpheres& a, A& bounds_a, const SphereTree& tree_b,
                PosedSpheres& b, B& bounds_b, float distance, std::vector<NodePair>& level,
                std::vector<NodePair>& next, std::vector<LeafPair>& leaf_pairs, QueryCounters& counters) {
    for (level.assign(1, {0, 0}); !level.empty(); std::swap(level, next)) {
        next.clear();
        counters.node_tests += static_cast<long>(level.size());
        counters.most_pairs = std::max(counters.most_pairs, static_cast<long>(level.size()));
        for (std::size_t i = 0; i < level.size(); ++i) {
            const NodePair pair = level[i];
            const SphereTree::Node& node_a = tree_a.nodes[pair.a];
            const SphereTree::Node& node_b = tree_b.nodes[pair.b];
            bool first_is_larger;
            if constexpr (BoxBound<A> && BoxBound<B>) {
                if (apart(bounds_a.box(pair.a), bounds_b.box(pair.b), distance)) continue;
                first_is_larger = face_count(node_a) >= face_count(node_b);
            } else {
                const Sphere& sphere_a = a.spheres.get(pair.a, bounds_a);
                const Sphere& sphere_b = b.spheres.get(pair.b, bounds_b);
                if (apart(sphere_a, sphere_b, distance)) continue;
                first_is_larger = sphere_a.r >= sphere_b.r;
            }

            if (node_a.is_leaf() && node_b.is_leaf()) {
                leaf_pairs.push_back(pair);
            } else if (node_b.is_leaf() || (!node_a.is_leaf() && first_is_larger)) {
                next.push_back({node_a.first_child, pair.b});
                next.push_back({node_a.first_child + 1, pair.b});
            } else {
                next.push_back({pair.a, node_b.first_child});
                next.push_back({pair.a, node_b.first_child + 1});
            }
        }
    }
    // The two were swapped, so the next walk may need either with the larger capacity.
    level.reserve(next.capacity());
    next.reserve(level.capacity());
}

}  // namespace

void PairQuery::require_finite(const PosedTree& a, const PosedTree& b) const {
    a.state_->require_finite();
    b.state_->require_finite();
}

template <class... Pairs>
void PairQuery::count_held(const Pairs&... pairs) noexcept {
    counters_.most_pairs = std::max({counters_.most_pairs, static_cast<long>(pairs.size())...});
}

void PairQuery::reserve(const PosedTree& a, const PosedTree& b, std::size_t pairs) {
    int packs = 0, leaves = 0;
    for (const PosedTree* body : {&a, &b}) {
        const PosedTreeState& state = *body->state_;
        for (const auto* wide : {&state.of_nodes, &state.of_surface}) {
            if (!*wide) continue;
            packs = std::max(packs, (*wide)->cluster_packs());
            leaves = std::max(leaves, (*wide)->tree().leaves());
        }
    }
    affine_walk_.reserve(packs, pairs);
    counting_sort_.reserve(pairs, leaves);
    for (auto* held : {&leaf_pairs_, &stack_, &next_}) held->reserve(pairs);
    pairs_.reserve(pairs);
}

void PairQuery::find_leaf_pairs(PosedTree& a, PosedTree& b, float distance) {
    counters_ = {};
    leaf_pairs_.clear();
    if (!a.state_->has_pose() || !b.state_->has_pose()) return;
    const auto bounded = [&] { return a.nodes_bounded() + (&a == &b ? 0 : b.nodes_bounded()); };
    const auto out_of_range = [&] {
        return a.nodes_out_of_range() + (&a == &b ? 0 : b.nodes_out_of_range());
    };
    const int bounded_before = bounded(), out_of_range_before = out_of_range();
    PosedSpheres &spheres_a = a.state_->spheres(), &spheres_b = b.state_->spheres();
    std::visit(
        [&](auto& bounds_a, auto& bounds_b) {
            walk_nodes(a.tree().spheres, spheres_a, bounds_a, b.tree().spheres, spheres_b, bounds_b, distance,
                       stack_, next_, leaf_pairs_, counters_);
        },
        spheres_a.bounds, spheres_b.bounds);
    counters_.nodes_bounded = bounded() - bounded_before;
    counters_.nodes_out_of_range = out_of_range() - out_of_range_before;
    counters_.leaf_pairs = leaf_pairs_.size();
    count_held(leaf_pairs_);
    require_finite(a, b);
}

template <class Walk>
void PairQuery::walk_wide(PosedTree& a, PosedTree& b, const Walk& walk) {
    counters_ = {};
    leaf_pairs_.clear();
    AffineBoxes &boxes_a = a.state_->wide(), &boxes_b = b.state_->wide();
    const auto fitted = [&] { return boxes_a.fitted() + (&a == &b ? 0 : boxes_b.fitted()); };
    const auto out_of_range = [&] {
        return boxes_a.out_of_range() + (&a == &b ? 0 : boxes_b.out_of_range());
    };
    const int fitted_before = fitted(), out_of_range_before = out_of_range();
    walk(boxes_a, boxes_b);
    counters_.nodes_bounded = fitted() - fitted_before;
    counters_.nodes_out_of_range = out_of_range() - out_of_range_before;
    counters_.node_tests = affine_walk_.counters().node_tests;
    counters_.leaf_pairs = affine_walk_.counters().leaf_pairs;
    counters_.box_tests = affine_walk_.counters().box_tests;
    counters_.most_pairs = affine_walk_.counters().most_pairs;
    require_finite(a, b);
}

template <class Narrow>
std::span<const FacePair> PairQuery::find_wide_pairs(PosedTree& a, PosedTree& b, float distance,
                                                     const Narrow& narrow) {
    AffineBoxes &boxes_a = a.state_->wide(), &boxes_b = b.state_->wide();
    walk_wide(a, b, [&](AffineBoxes& s, AffineBoxes& t) { affine_walk_.near_faces(s, t, distance, pairs_); });
    counters_.triangle_tests = pairs_.size();
    count_held(pairs_);
    narrow(pairs_, boxes_a, boxes_b);
    for (FacePair& pair : pairs_) pair = {boxes_a.face(pair.a), boxes_b.face(pair.b)};
    counters_.face_pairs = pairs_.size();
    return pairs_;
}

template <class Narrow>
std::span<const FacePair> PairQuery::find_sphere_tree_pairs(PosedTree& a, PosedTree& b, float distance,
                                                            const Narrow& narrow) {
    find_leaf_pairs(a, b, distance);
    pairs_.clear();
    LeafBoxes &boxes_a = a.state_->spheres().boxes, &boxes_b = b.state_->spheres().boxes;
    const auto opened = [&] { return boxes_a.opened() + (&a == &b ? 0 : boxes_b.opened()); };
    const long opened_before = opened();
    for (std::size_t i = 0; i < leaf_pairs_.size(); ++i) {
        const LeafPair pair = leaf_pairs_[i];
        if (i + 2 < leaf_pairs_.size()) {
            boxes_a.prefetch_vertices(boxes_a.root(leaf_pairs_[i + 2].a));
            boxes_b.prefetch_vertices(boxes_b.root(leaf_pairs_[i + 2].b));
        }
        if (i + 1 < leaf_pairs_.size()) {
            boxes_a.prefetch_positions(boxes_a.root(leaf_pairs_[i + 1].a));
            boxes_b.prefetch_positions(boxes_b.root(leaf_pairs_[i + 1].b));
        }
        const auto walk = [&](const auto& near) {
            walk_boxes(boxes_a, boxes_a.root(pair.a), boxes_b, boxes_b.root(pair.b), near, TwoBodies{},
                       stack_, pairs_, counters_);
        };
        if (distance == 0)
            walk(Overlapping{});
        else
            walk(Within(distance));
    }
    counters_.boxes_refitted = opened() - opened_before;
    counters_.triangle_tests = pairs_.size();
    count_held(pairs_);
    require_finite(a, b);
    narrow(pairs_, boxes_a.faces(), boxes_b.faces());
    for (FacePair& pair : pairs_) pair = {boxes_a.face(pair.a), boxes_b.face(pair.b)};
    counters_.face_pairs = pairs_.size();
    return pairs_;
}

template <class Narrow>
std::span<const FacePair> PairQuery::find_face_pairs(PosedTree& a, PosedTree& b, float distance,
                                                     const Narrow& narrow) {
    require_distance(distance);
    return walk_wide_trees(*a.state_, *b.state_) ? find_wide_pairs(a, b, distance, narrow)
                                                 : find_sphere_tree_pairs(a, b, distance, narrow);
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
    const auto keep_near = [&](std::vector<FacePair>& pairs, const auto& in_a, const auto& in_b) {
        keep_within(pairs, in_a, in_b, distance);
    };
    find_face_pairs(a, b, distance, keep_near);
    return sorted_pairs();
}

std::span<const FacePair> PairQuery::boxes_within(PosedTree& a, PosedTree& b, float distance) {
    const PosedTreeState &s = *a.state_, &t = *b.state_;
    if ((s.in_step || t.in_step) && s.has_pose() && t.has_pose() && !(s.has_wide() && t.has_wide()))
        throw std::invalid_argument(message("one body is in a step and the other, with ",
                                            name(s.in_step ? t.kind : s.kind),
                                            " bounds, in a pose; allowed: both in a step, or a pose with "
                                            "boxes, affine, learned_affine or auto bounds"));
    return find_face_pairs(a, b, distance, [](std::vector<FacePair>&, const auto&, const auto&) {});
}

std::span<const LeafPair> PairQuery::box_leaves_within(PosedTree& a, PosedTree& b, float distance,
                                                       const BlockReach& reach) {
    require_distance(distance);
    for (const PosedTree* body : {&a, &b})
        if (!body->box_tree())
            throw std::invalid_argument(message("leaves of box trees of a body with ", name(body->kind()),
                                                " bounds; allowed: boxes, affine, learned_affine"));
    walk_wide_trees(*a.state_, *b.state_);
    std::span<const LeafPair> found;
    walk_wide(a, b, [&](AffineBoxes& s, AffineBoxes& t) {
        found = affine_walk_.near_leaves(s, t, distance, reach);
    });
    leaf_pairs_.assign(found.begin(), found.end());
    counting_sort_.sort(leaf_pairs_, b.box_tree()->leaves(), [](const LeafPair& pair) { return pair.b; });
    counting_sort_.sort(leaf_pairs_, a.box_tree()->leaves(), [](const LeafPair& pair) { return pair.a; });
    return leaf_pairs_;
}

std::span<const LeafPair> PairQuery::leaf_pairs(PosedTree& a, PosedTree& b, float distance) {
    require_distance(distance);
    find_leaf_pairs(a, b, distance);
    std::ranges::sort(leaf_pairs_);
    return leaf_pairs_;
}

}  // namespace nbd
