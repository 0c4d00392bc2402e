#include "collision/query/closest_query.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <stdexcept>

#include "collision/base/message.hpp"
#include "collision/kernels/lane_mask.hpp"
#include "collision/query/least_distance.hpp"
#include "collision/query/near_boxes.hpp"
#include "collision/tree/posed_tree_state.hpp"

namespace nbd {
namespace {

double least_distance(const Sphere& s, const Sphere& t) noexcept {
    const double between = (s.c.cast<double>() - t.c.cast<double>()).norm(), radii = double{s.r} + t.r;
    return std::max(between - radii - least_distance_slack * (between + radii), 0.);
}

double least_distance(PosedTree& a, int i, PosedTree& b, int j) {
    const bool boxes = is_box(a.kind()) && is_box(b.kind());
    return boxes ? least_distance(*a.box(i), *b.box(j)) : least_distance(a.sphere(i), b.sphere(j));
}

}  // namespace

void ClosestQuery::push(const Candidate& candidate) {
    // A body without a pose is infinitely far away.
    if (!(candidate.distance <= most_ && std::isfinite(candidate.distance))) return;
    queue_.push_back(candidate);
    most_candidates_ = std::max(most_candidates_, queue_.size());
    std::ranges::push_heap(queue_, std::greater());
}

ClosestQuery::Candidate ClosestQuery::pop() noexcept {
    std::ranges::pop_heap(queue_, std::greater());
    const Candidate first = queue_.back();
    queue_.pop_back();
    return first;
}

void ClosestQuery::push_nodes(PosedTree& a, int i, PosedTree& b, int j) {
    push({least_distance(a, i, b, j), Candidate::nodes, i, j});
}

void ClosestQuery::open_nodes(PosedTree& a, int i, PosedTree& b, int j) {
    const SphereTree::Node& node_a = a.tree().spheres.nodes[i];
    const SphereTree::Node& node_b = b.tree().spheres.nodes[j];
    const bool first_is_larger = node_a.face_end - node_a.face_begin >= node_b.face_end - node_b.face_begin;
    if (node_a.is_leaf() && node_b.is_leaf()) {
        LeafBoxes &boxes_a = a.state_->spheres().boxes, &boxes_b = b.state_->spheres().boxes;
        const int root_a = boxes_a.root(i), root_b = boxes_b.root(j);
        boxes_a.open(root_a);
        boxes_b.open(root_b);
        push(
            {least_distance(boxes_a.whole(root_a), boxes_b.whole(root_b)), Candidate::boxes, root_a, root_b});
    } else if (node_b.is_leaf() || (!node_a.is_leaf() && first_is_larger)) {
        push_nodes(a, node_a.first_child, b, j);
        push_nodes(a, node_a.first_child + 1, b, j);
    } else {
        push_nodes(a, i, b, node_b.first_child);
        push_nodes(a, i, b, node_b.first_child + 1);
    }
}

void ClosestQuery::open_boxes(LeafBoxes& a, int i, LeafBoxes& b, int j) {
    const LeafBoxes::Node &node_a = a.node(i), &node_b = b.node(j);
    if (node_a.has_faces() && node_b.has_faces()) {
        open_faces(a, i, b, j);
    } else if (node_b.has_faces() || (!node_a.has_faces() && node_a.count >= node_b.count)) {
        const LeafBoxes::Opened& boxes = a.open(i);
        const Box whole = b.whole(j);
        for (int k = 0; k < node_a.count; ++k)
            push({least_distance(boxes.box(k), whole), Candidate::boxes, node_a.first_child + k, j});
    } else {
        const LeafBoxes::Opened& boxes = b.open(j);
        const Box whole = a.whole(i);
        for (int k = 0; k < node_b.count; ++k)
            push({least_distance(whole, boxes.box(k)), Candidate::boxes, i, node_b.first_child + k});
    }
}

void ClosestQuery::open_faces(LeafBoxes& a, int i, LeafBoxes& b, int j) {
    const LeafBoxes::Node &node_a = a.node(i), &node_b = b.node(j);
    const LeafBoxes::Opened &boxes_a = a.open(i), &boxes_b = b.open(j);
    // Measuring one near pair right away keeps most other pairs out of the queue.
    const Box whole = b.whole(j);
    const int k = nearest_box(boxes_a, boxes_a.count, whole),
              l = nearest_box(boxes_b, boxes_b.count, boxes_a.box(k));
    test_faces(a, node_a.first_slot + k, b, node_b.first_slot + l);
    const Within near = within_at_most(most_);
    const unsigned near_b = near_boxes(boxes_a, whole, near);
    unsigned masks[LeafBoxes::max_boxes];
    near_boxes(boxes_b, boxes_a, near_b, near, masks);
    for_each_bit(near_b, [&](int m) {
        const Box box = boxes_a.box(m);
        for_each_bit(masks[m], [&](int n) {
            if (m != k || n != l)
                push({least_distance(box, boxes_b.box(n)), Candidate::faces, node_a.first_slot + m,
                      node_b.first_slot + n});
        });
    });
}

void ClosestQuery::test_faces(const LeafBoxes& a, int slot_a, const LeafBoxes& b, int slot_b) noexcept {
    measure({a.face(slot_a), b.face(slot_b)}, a.triangle(slot_a), b.triangle(slot_b));
}

void ClosestQuery::measure(const FacePair& faces, const Triangle& s, const Triangle& t) noexcept {
    ++triangle_tests_;
    const double distance = triangle_distance(s, t);
    if (distance < most_ || (distance == most_ && (!closest_ || faces < *closest_))) {
        most_ = distance;
        closest_ = faces;
        triangles_ = {s, t};
    }
}

void ClosestQuery::search_sphere_trees(PosedTree& a, PosedTree& b) {
    LeafBoxes &boxes_a = a.state_->spheres().boxes, &boxes_b = b.state_->spheres().boxes;
    push_nodes(a, 0, b, 0);
    while (goes_on()) {
        const Candidate pair = pop();
        if (pair.level == Candidate::nodes)
            open_nodes(a, pair.a, b, pair.b);
        else if (pair.level == Candidate::boxes)
            open_boxes(boxes_a, pair.a, boxes_b, pair.b);
        else
            test_faces(boxes_a, pair.a, boxes_b, pair.b);
    }
}

bool ClosestQuery::goes_on() const noexcept {
    return !queue_.empty() && queue_.front().distance <= most_ && !(closest_ && most_ == 0);
}

std::optional<ClosestFaces> ClosestQuery::closest(PosedTree& a, PosedTree& b, double most) {
    if (!(most >= 0)) throw std::invalid_argument(message("distance is ", most, " m, allowed: 0 or more"));
    queue_.clear();
    triangle_tests_ = 0;
    most_candidates_ = 0;
    most_ = most;
    closest_.reset();
    if (walk_wide_trees(*a.state_, *b.state_))
        search_wide(a.state_->wide(), b.state_->wide());
    else
        search_sphere_trees(a, b);
    a.state_->require_finite();
    b.state_->require_finite();
    if (!closest_) return std::nullopt;
    return ClosestFaces{*closest_, closest_triangle_triangle(triangles_[0], triangles_[1])};
}

}  // namespace nbd
