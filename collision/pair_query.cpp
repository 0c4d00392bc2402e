#include "collision/pair_query.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "collision/closest_points.hpp"
#include "collision/posed_tree_state.hpp"
#include "collision/separation.hpp"
#include "collision/triangle_triangle.hpp"

namespace nbd {
namespace {

int face_count(const SphereTree::Node& node) noexcept { return node.face_end - node.face_begin; }

/// The walk of PairQuery over the sphere trees, for one pair of kinds of bounds.
template <Bound A, Bound B>
void walk_nodes(PosedTreeState& a, A& bounds_a, PosedTreeState& b, B& bounds_b, float distance,
                std::vector<NodePair>& stack, std::vector<LeafPair>& leaf_pairs,
                QueryCounters& counters) noexcept {
    stack.assign(1, {0, 0});
    while (!stack.empty()) {
        const NodePair pair = stack.back();
        stack.pop_back();
        const SphereTree::Node& node_a = a.tree->spheres.nodes[static_cast<std::size_t>(pair.a)];
        const SphereTree::Node& node_b = b.tree->spheres.nodes[static_cast<std::size_t>(pair.b)];
        ++counters.node_tests;
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
            stack.push_back({node_a.first_child, pair.b});
            stack.push_back({node_a.first_child + 1, pair.b});
        } else {
            stack.push_back({pair.a, node_b.first_child});
            stack.push_back({pair.a, node_b.first_child + 1});
        }
    }
}

template <class Touch>
void test_faces(const LeafBoxes& a, const LeafBoxes::Node& node_a, const LeafBoxes& b,
                const LeafBoxes::Node& node_b, float distance, const Touch& touch,
                std::vector<FacePair>& face_pairs, QueryCounters& counters) noexcept {
    const FaceBoxes &boxes_a = a.face_boxes(node_a), &boxes_b = b.face_boxes(node_b);
    const int count_a = node_a.face_end - node_a.face_begin, count_b = node_b.face_end - node_b.face_begin;
    const float most = certain_square(distance);
    counters.box_tests += count_a * count_b;
    for (int i = 0; i < count_a; ++i) {
        const Eigen::Array4f squared = squared_gaps(boxes_a, i, boxes_b);
        if (squared.minCoeff() > most) continue;
        const Triangle face_a = a.triangle(node_a.face_begin + i);
        for (int j = 0; j < count_b; ++j) {
            if (squared[j] > most) continue;
            ++counters.triangle_tests;
            if (touch(face_a, b.triangle(node_b.face_begin + j)))
                face_pairs.push_back({a.face(node_a.face_begin + i), b.face(node_b.face_begin + j)});
        }
    }
}

/// The walk over the boxes under a pair of leaves.
template <class Touch>
void walk_boxes(const LeafBoxes& a, int root_a, const LeafBoxes& b, int root_b, float distance,
                const Touch& touch, std::vector<NodePair>& stack, std::vector<FacePair>& face_pairs,
                QueryCounters& counters) noexcept {
    stack.assign(1, {root_a, root_b});
    while (!stack.empty()) {
        const NodePair pair = stack.back();
        stack.pop_back();
        ++counters.box_tests;
        if (apart(a.box(pair.a), b.box(pair.b), distance)) continue;

        const LeafBoxes::Node &node_a = a.node(pair.a), &node_b = b.node(pair.b);
        const int faces_a = node_a.face_end - node_a.face_begin,
                  faces_b = node_b.face_end - node_b.face_begin;
        if (node_a.is_leaf() && node_b.is_leaf()) {
            test_faces(a, node_a, b, node_b, distance, touch, face_pairs, counters);
        } else if (node_b.is_leaf() || (!node_a.is_leaf() && faces_a >= faces_b)) {
            stack.push_back({node_a.first_child, pair.b});
            stack.push_back({node_a.first_child + 1, pair.b});
        } else {
            stack.push_back({pair.a, node_b.first_child});
            stack.push_back({pair.a, node_b.first_child + 1});
        }
    }
}

}  // namespace

void PairQuery::find_leaf_pairs(PosedTree& a, PosedTree& b, float distance) noexcept {
    assert(distance >= 0 && std::isfinite(distance));
    counters_ = {};
    leaf_pairs_.clear();
    const auto bounded = [&] { return a.nodes_bounded() + (&a == &b ? 0 : b.nodes_bounded()); };
    const auto out_of_range = [&] {
        return a.nodes_out_of_range() + (&a == &b ? 0 : b.nodes_out_of_range());
    };
    const int bounded_before = bounded(), out_of_range_before = out_of_range();
    std::visit(
        [&](auto& bounds_a, auto& bounds_b) {
            walk_nodes(*a.state_, bounds_a, *b.state_, bounds_b, distance, stack_, leaf_pairs_, counters_);
        },
        a.state_->bounds, b.state_->bounds);
    counters_.nodes_bounded = bounded() - bounded_before;
    counters_.nodes_out_of_range = out_of_range() - out_of_range_before;
    counters_.leaf_pairs = static_cast<long>(leaf_pairs_.size());
}

template <class Touch>
void PairQuery::find_face_pairs(PosedTree& a, PosedTree& b, float distance, const Touch& touch) noexcept {
    find_leaf_pairs(a, b, distance);
    face_pairs_.clear();
    LeafBoxes &boxes_a = a.state_->boxes, &boxes_b = b.state_->boxes;
    for (const LeafPair& pair : leaf_pairs_) {
        counters_.boxes_refitted += boxes_a.refit(pair.a) + boxes_b.refit(pair.b);
        walk_boxes(boxes_a, boxes_a.root(pair.a), boxes_b, boxes_b.root(pair.b), distance, touch, stack_,
                   face_pairs_, counters_);
    }
    // Every face belongs to one leaf, so no pair comes twice.
    std::ranges::sort(face_pairs_);
    counters_.face_pairs = static_cast<long>(face_pairs_.size());
}

std::span<const FacePair> PairQuery::intersecting(PosedTree& a, PosedTree& b) noexcept {
    find_face_pairs(a, b, 0, [](const Triangle& s, const Triangle& t) { return triangles_intersect(s, t); });
    return face_pairs_;
}

std::span<const FacePair> PairQuery::within(PosedTree& a, PosedTree& b, float distance) noexcept {
    find_face_pairs(a, b, distance, [distance](const Triangle& s, const Triangle& t) {
        return triangle_distance(s, t) <= double{distance};
    });
    return face_pairs_;
}

std::span<const FacePair> PairQuery::boxes_within(PosedTree& a, PosedTree& b, float distance) noexcept {
    find_face_pairs(a, b, distance, [](const Triangle&, const Triangle&) { return true; });
    return face_pairs_;
}

std::span<const LeafPair> PairQuery::leaf_pairs(PosedTree& a, PosedTree& b, float distance) noexcept {
    find_leaf_pairs(a, b, distance);
    std::ranges::sort(leaf_pairs_);
    return leaf_pairs_;
}

}  // namespace nbd
