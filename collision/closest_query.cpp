#include "collision/closest_query.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <functional>

#include "collision/posed_tree_state.hpp"

namespace nbd {
namespace {

/// Covers the roundings in double precision of the distances below, relative to the lengths they come from.
constexpr double slack = 1e-14;

double least_distance(const Box& s, const Box& t) noexcept {
    double squared = 0;
    for (int axis = 0; axis < 3; ++axis) {
        const double gap = std::max(double{s.lo[axis]} - t.hi[axis], double{t.lo[axis]} - s.hi[axis]);
        if (gap > 0) squared += gap * gap;
    }
    return std::sqrt(squared) * (1 - slack);
}

double least_distance(const Sphere& s, const Sphere& t) noexcept {
    const double between = (s.c.cast<double>() - t.c.cast<double>()).norm(), radii = double{s.r} + t.r;
    return std::max(between - radii - slack * (between + radii), 0.);
}

double least_distance(PosedTree& a, int i, PosedTree& b, int j) noexcept {
    const bool boxes = is_box(a.kind()) && is_box(b.kind());
    return boxes ? least_distance(*a.box(i), *b.box(j)) : least_distance(a.sphere(i), b.sphere(j));
}

}  // namespace

void ClosestQuery::push(const Candidate& candidate, double most) noexcept {
    // Infinitely far is what has no pose yet.
    if (!(candidate.distance <= most && std::isfinite(candidate.distance))) return;
    queue_.push_back(candidate);
    std::ranges::push_heap(queue_, std::greater());
}

ClosestQuery::Candidate ClosestQuery::pop() noexcept {
    std::ranges::pop_heap(queue_, std::greater());
    const Candidate first = queue_.back();
    queue_.pop_back();
    return first;
}

void ClosestQuery::open_boxes(LeafBoxes& a, int i, LeafBoxes& b, int j, double most) noexcept {
    const LeafBoxes::Node &node_a = a.node(i), &node_b = b.node(j);
    const bool faces_a = node_a.has_faces(), faces_b = node_b.has_faces();
    // Faces wait until the other side has come down to faces too.
    const bool open_a = !faces_a || faces_b, open_b = !faces_b || faces_a;
    const Box whole_b = b.whole(j);
    for (int k = 0; k < (open_a ? node_a.count : 1); ++k) {
        const Box box_a = open_a ? a.open(i).box(k) : a.whole(i);
        if (!(least_distance(box_a, whole_b) <= most)) continue;
        for (int l = 0; l < (open_b ? node_b.count : 1); ++l) {
            const Box box_b = open_b ? b.open(j).box(l) : whole_b;
            const double distance = least_distance(box_a, box_b);
            if (faces_a && faces_b)
                push({distance, Candidate::faces, node_a.first_slot + k, node_b.first_slot + l}, most);
            else
                push({distance, Candidate::boxes, open_a ? node_a.first_child + k : i,
                      open_b ? node_b.first_child + l : j},
                     most);
        }
    }
}

void ClosestQuery::push_nodes(PosedTree& a, int i, PosedTree& b, int j, double most) noexcept {
    push({least_distance(a, i, b, j), Candidate::nodes, i, j}, most);
}

void ClosestQuery::open_nodes(PosedTree& a, int i, PosedTree& b, int j, double most) noexcept {
    const SphereTree::Node& node_a = a.tree().spheres.nodes[static_cast<std::size_t>(i)];
    const SphereTree::Node& node_b = b.tree().spheres.nodes[static_cast<std::size_t>(j)];
    const bool first_is_larger = node_a.face_end - node_a.face_begin >= node_b.face_end - node_b.face_begin;
    if (node_a.is_leaf() && node_b.is_leaf()) {
        LeafBoxes &boxes_a = a.state_->boxes, &boxes_b = b.state_->boxes;
        const int root_a = boxes_a.root(i), root_b = boxes_b.root(j);
        boxes_a.open(root_a);
        boxes_b.open(root_b);
        push({least_distance(boxes_a.whole(root_a), boxes_b.whole(root_b)), Candidate::boxes, root_a, root_b},
             most);
    } else if (node_b.is_leaf() || (!node_a.is_leaf() && first_is_larger)) {
        push_nodes(a, node_a.first_child, b, j, most);
        push_nodes(a, node_a.first_child + 1, b, j, most);
    } else {
        push_nodes(a, i, b, node_b.first_child, most);
        push_nodes(a, i, b, node_b.first_child + 1, most);
    }
}

std::optional<ClosestFaces> ClosestQuery::closest(PosedTree& a, PosedTree& b, double most) noexcept {
    assert(most >= 0);
    LeafBoxes &boxes_a = a.state_->boxes, &boxes_b = b.state_->boxes;
    queue_.clear();
    triangle_tests_ = 0;
    std::optional<FacePair> closest;
    Triangle triangle_a, triangle_b;  // of `closest`
    push_nodes(a, 0, b, 0, most);
    while (!queue_.empty() && queue_.front().distance <= most && !(closest && most == 0)) {
        const Candidate pair = pop();
        if (pair.level == Candidate::nodes) {
            open_nodes(a, pair.a, b, pair.b, most);
        } else if (pair.level == Candidate::boxes) {
            open_boxes(boxes_a, pair.a, boxes_b, pair.b, most);
        } else {
            ++triangle_tests_;
            const Triangle s = boxes_a.triangle(pair.a), t = boxes_b.triangle(pair.b);
            const FacePair faces{boxes_a.face(pair.a), boxes_b.face(pair.b)};
            const double distance = triangle_distance(s, t);
            if (distance < most || (distance == most && (!closest || faces < *closest))) {
                most = distance;
                closest = faces;
                triangle_a = s;
                triangle_b = t;
            }
        }
    }
    if (!closest) return std::nullopt;
    return ClosestFaces{*closest, closest_triangle_triangle(triangle_a, triangle_b)};
}

}  // namespace nbd
