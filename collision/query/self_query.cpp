#include "collision/query/self_query.hpp"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "collision/base/message.hpp"
#include "collision/geometry/separation.hpp"
#include "collision/neighbours/neighbour_proof.hpp"
#include "collision/query/box_walk.hpp"
#include "collision/query/keep_intersecting.hpp"
#include "collision/query/keep_within.hpp"
#include "collision/query/one_body.hpp"
#include "collision/query/require_distance.hpp"
#include "collision/tree/posed_tree_state.hpp"

namespace nbd {
namespace {

/// Pairs of faces that are tested at a time, at least; their data stay in the cache.
constexpr std::size_t batch_size = 2048;

/// The walk over a sphere tree with itself, for one type of bounds. A node is near itself, so its bound is
/// needed only beside another node. stack: scratch.
template <Bound B>
void walk_nodes(const SphereTree& tree, PosedSpheres& posed, B& bounds, float distance,
                std::vector<NodePair>& stack, std::vector<LeafPair>& leaf_pairs, QueryCounters& counters) {
    const auto near = [&](const NodePair& pair) {
        if constexpr (BoxBound<B>)
            return !apart(bounds.box(pair.a), bounds.box(pair.b), distance);
        else {
            const Sphere s = posed.spheres.get(pair.a, bounds);
            return !apart(s, posed.spheres.get(pair.b, bounds), distance);
        }
    };
    for (stack.assign(1, {0, 0}); !stack.empty();) {
        counters.most_pairs = std::max(counters.most_pairs, static_cast<long>(stack.size()));
        const NodePair pair = stack.back();
        stack.pop_back();
        ++counters.node_tests;
        if (pair.a != pair.b && !near(pair)) continue;
        const SphereTree::Node& a = tree.nodes[pair.a];
        const SphereTree::Node& b = tree.nodes[pair.b];
        if (a.is_leaf() && b.is_leaf()) {
            leaf_pairs.push_back(pair);
        } else if (pair.a == pair.b) {
            stack.push_back({a.first_child, a.first_child});
            stack.push_back({a.first_child, a.first_child + 1});
            stack.push_back({a.first_child + 1, a.first_child + 1});
        } else if (b.is_leaf() || (!a.is_leaf() && a.face_end - a.face_begin >= b.face_end - b.face_begin)) {
            stack.push_back({a.first_child, pair.b});
            stack.push_back({a.first_child + 1, pair.b});
        } else {
            stack.push_back({pair.a, b.first_child});
            stack.push_back({pair.a, b.first_child + 1});
        }
    }
}

}  // namespace

void SelfQuery::find_leaf_pairs(PosedSpheres& posed, const SphereTree& tree, float distance) {
    leaf_pairs_.clear();
    std::visit(
        [&](auto& bounds) { walk_nodes(tree, posed, bounds, distance, stack_, leaf_pairs_, counters_); },
        posed.bounds);
    counters_.leaf_pairs = leaf_pairs_.size();
    counters_.most_pairs = std::max(counters_.most_pairs, counters_.leaf_pairs);
}

void SelfQuery::use(const NeighbourProof* proof) {
    if (proof && proof->left_out() != left_out_)
        throw std::invalid_argument("the proof takes other pairs of faces for left out than the query");
    proof_ = proof;
}

void SelfQuery::reserve(const PosedTree& body, std::size_t pairs) {
    const PosedTreeState& state = *body.state_;
    for (const auto* wide : {&state.of_nodes, &state.of_surface})
        if (*wide) affine_walk_.reserve((*wide)->cluster_packs(), pairs);
    for (auto* held : {&leaf_pairs_, &stack_}) held->reserve(pairs);
    for (auto* held : {&batch_, &pairs_}) held->reserve(pairs);
}

template <class Boxes, class Posed, class Narrow>
void SelfQuery::finish_batch(const Boxes& boxes, const Posed& posed, const Narrow& narrow) {
    counters_.triangle_tests += static_cast<long>(batch_.size());
    counters_.most_pairs = std::max(counters_.most_pairs, static_cast<long>(batch_.size()));
    // In the order of faces, on which the rounding of a distance depends.
    for (FacePair& slots : batch_)
        if (boxes.face(slots.a) > boxes.face(slots.b)) std::swap(slots.a, slots.b);
    narrow(batch_, posed);
    for (const FacePair& slots : batch_) pairs_.push_back({boxes.face(slots.a), boxes.face(slots.b)});
    batch_.clear();
}

template <class Narrow>
void SelfQuery::find_wide_pairs(AffineBoxes& boxes, float distance, const Narrow& narrow,
                                const LeafReach* reach) {
    const int fitted_before = boxes.fitted();
    const bool proof_applies = proof_ && &proof_->tree() == &boxes.tree() && !boxes.in_step() &&
                               (reach || distance <= proof_->proved_distance());
    const NeighbourProof* proof = proof_applies ? proof_ : nullptr;
    affine_walk_.begin_one_body(boxes, distance);
    for (bool more = true; more;) {
        more = affine_walk_.next_near_faces(boxes, left_out_.get(), proof, reach, batch_size, batch_);
        finish_batch(boxes, boxes, narrow);
    }
    counters_.nodes_bounded = boxes.fitted() - fitted_before;
    counters_.node_tests = affine_walk_.counters().node_tests;
    counters_.leaf_pairs = affine_walk_.counters().leaf_pairs;
    counters_.leaf_pairs_proved = affine_walk_.counters().proved;
    counters_.box_tests = affine_walk_.counters().box_tests;
    counters_.most_pairs = std::max(counters_.most_pairs, affine_walk_.counters().most_pairs);
}

template <class Narrow>
void SelfQuery::find_sphere_pairs(PosedSpheres& posed, const SphereTree& tree, float distance,
                                  const Narrow& narrow) {
    const int bounded_before = posed.nodes_bounded(), out_of_range_before = posed.nodes_out_of_range();
    find_leaf_pairs(posed, tree, distance);
    counters_.nodes_bounded = posed.nodes_bounded() - bounded_before;
    counters_.nodes_out_of_range = posed.nodes_out_of_range() - out_of_range_before;
    LeafBoxes& boxes = posed.boxes;
    const long opened_before = boxes.opened();
    for (const LeafPair& pair : leaf_pairs_) {
        const auto walk = [&](const auto& near) {
            walk_boxes(boxes, boxes.root(pair.a), boxes, boxes.root(pair.b), near,
                       OneBody(boxes, left_out_.get(), nullptr), stack_, batch_, counters_);
        };
        if (distance == 0)
            walk(Overlapping{});
        else
            walk(Within(distance));
        if (batch_.size() >= batch_size) finish_batch(boxes, boxes.faces(), narrow);
    }
    finish_batch(boxes, boxes.faces(), narrow);
    counters_.boxes_refitted = boxes.opened() - opened_before;
}

template <class Narrow>
std::span<const FacePair> SelfQuery::find_face_pairs(PosedTree& body, float distance, const Narrow& narrow,
                                                     const LeafReach* reach) {
    require_distance(distance);
    if (left_out_ && left_out_->face_count() != body.tree().faces.rows())
        throw std::invalid_argument(message("the query leaves out pairs of a surface of ",
                                            left_out_->face_count(), " faces, but the body has ",
                                            body.tree().faces.rows()));
    counters_ = {};
    batch_.clear();
    pairs_.clear();
    if (walk_wide_trees(*body.state_, *body.state_))
        find_wide_pairs(body.state_->wide(), distance, narrow, reach);
    else
        find_sphere_pairs(body.state_->spheres(), body.tree().spheres, distance, narrow);
    body.state_->require_finite();
    counters_.face_pairs = pairs_.size();
    counters_.most_pairs = std::max(counters_.most_pairs, counters_.face_pairs);
    return pairs_;
}

std::span<const FacePair> SelfQuery::sorted_pairs() {
    std::ranges::sort(pairs_);
    return pairs_;
}

std::span<const FacePair> SelfQuery::intersecting(PosedTree& body) {
    find_face_pairs(body, 0, [](std::vector<FacePair>& pairs, const auto& posed) {
        keep_intersecting(pairs, posed, posed);
    });
    return sorted_pairs();
}

std::span<const FacePair> SelfQuery::within(PosedTree& body, float distance) {
    find_face_pairs(body, distance, [distance](std::vector<FacePair>& pairs, const auto& posed) {
        keep_within(pairs, posed, posed, distance);
    });
    return sorted_pairs();
}

std::span<const FacePair> SelfQuery::boxes_within(PosedTree& body, float distance, const LeafReach* reach) {
    return find_face_pairs(
        body, distance, [](std::vector<FacePair>&, const auto&) {}, reach);
}

std::shared_ptr<const FacePairSet> near_at_rest(VerticesRef X, FacesRef F, float distance) {
    require_distance(distance);
    PosedTree body(shared_exact_tree(X, F), BoundKind::boxes);
    body.begin_pose(VertexView::as_long_as(X));
    return std::make_shared<const FacePairSet>(SelfQuery().within(body, distance), F.rows());
}

}  // namespace nbd
