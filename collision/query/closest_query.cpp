#include "collision/query/closest_query.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <functional>
#include <stdexcept>

#include "collision/base/message.hpp"
#include "collision/bounds/walk.hpp"
#include "collision/wide_tree/wide_walk.hpp"

namespace nbd {
namespace {

/// Covers the rounding of distances in double precision, relative to the lengths they come from.
constexpr double slack = 1e-14;

/// Lower bound on the distance of two boxes, metres.
double least_distance(const Box& s, const Box& t) noexcept {
    double squared = 0;
    for (int axis = 0; axis < 3; ++axis) {
        const double gap = std::max(double{s.lo[axis]} - t.hi[axis], double{t.lo[axis]} - s.hi[axis]);
        if (gap > 0) squared += gap * gap;
    }
    return std::sqrt(squared) * (1 - slack);
}

/// Index of the box among the first `count` of a pack that is nearest to t; the first of equally near ones.
int nearest_box(const BoxPack& boxes, int count, const Box& t) noexcept {
    int nearest = 0;
    double least = std::numeric_limits<double>::infinity();
    for (int k = 0; k < count; ++k) {
        const double distance = least_distance(boxes.box(k), t);
        if (distance < least) {
            least = distance;
            nearest = k;
        }
    }
    return nearest;
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

bool ClosestQuery::goes_on() const noexcept {
    return !queue_.empty() && queue_.front().distance <= most_ && !(closest_ && most_ == 0);
}

void ClosestQuery::measure(const PosedWideTree& a, int slot_a, const PosedWideTree& b, int slot_b) noexcept {
    ++triangle_tests_;
    const FacePair faces{a.face(slot_a), b.face(slot_b)};
    const Triangle s = a.triangle(slot_a), t = b.triangle(slot_b);
    const double distance = triangle_distance(s, t);
    if (distance < most_ || (distance == most_ && (!closest_ || faces < *closest_))) {
        most_ = distance;
        closest_ = faces;
        triangles_ = {s, t};
    }
}

/// Puts the pairs of children that may be close enough into the queue. whole_t: box around all boxes of t.
void ClosestQuery::push_children(Candidate::Level level, const BoxPack& s, unsigned in_s, int first_a,
                                 const BoxPack& t, unsigned in_t, int first_b, const Box& whole_t) {
    const Within near = within_at_most(most_);
    for_each_bit(near_boxes(s, whole_t, near) & in_s, [&](int i) {
        const Box box = s.box(i);
        for_each_bit(near_boxes(t, box, near) & in_t, [&](int j) {
            push({least_distance(box, t.box(j)), level, first_a + i, first_b + j});
        });
    });
}

template <class Level>
void ClosestQuery::open_children(Candidate::Level children, PosedWideTree& a, int node_a, PosedWideTree& b,
                                 int node_b) {
    Level::children(a, node_a);
    Level::children(b, node_b);  // may move those of a, if both are one body
    const PosedWideTree::Children &s = Level::children(a, node_a), &t = Level::children(b, node_b);
    push_children(children, s.boxes, Level::present(a, node_a), Level::first_child(a, node_a), t.boxes,
                  Level::present(b, node_b), Level::first_child(b, node_b), t.whole);
}

void ClosestQuery::open_leaves(PosedWideTree& a, int leaf_a, PosedWideTree& b, int leaf_b) {
    a.leaf(leaf_a);
    b.leaf(leaf_b);  // may move the first one, if both are one body
    const PosedWideTree::Leaf &s = a.leaf(leaf_a), &t = b.leaf(leaf_b);
    const unsigned in_s = a.present_faces(leaf_a), in_t = b.present_faces(leaf_b);
    // Measuring one near pair right away keeps most other pairs out of the queue.
    const int i = nearest_box(s.boxes, std::popcount(in_s), t.whole),
              j = nearest_box(t.boxes, std::popcount(in_t), s.boxes.box(i));
    measure(a, tree_width * leaf_a + i, b, tree_width * leaf_b + j);
    push_children(Candidate::faces, s.boxes, in_s, tree_width * leaf_a, t.boxes, in_t, tree_width * leaf_b,
                  t.whole);
}

void ClosestQuery::search(PosedWideTree& a, PosedWideTree& b) {
    for (int i = 0; i < a.tree().clusters(); ++i)
        push({least_distance(a.cluster(i), b.whole()), Candidate::bodies, i, 0});
    while (goes_on()) {
        const Candidate pair = pop();
        if (pair.level == Candidate::bodies)
            for (int j = 0; j < b.tree().clusters(); ++j)
                push({least_distance(a.cluster(pair.a), b.cluster(j)), Candidate::clusters, pair.a, j});
        else if (pair.level == Candidate::clusters)
            open_children<ClusterLevel>(Candidate::blocks, a, pair.a, b, pair.b);
        else if (pair.level == Candidate::blocks)
            open_children<BlockLevel>(Candidate::leaves, a, pair.a, b, pair.b);
        else if (pair.level == Candidate::leaves)
            open_leaves(a, pair.a, b, pair.b);
        else
            measure(a, pair.a, b, pair.b);
    }
}

std::optional<ClosestFaces> ClosestQuery::closest(PosedTree& a, PosedTree& b, double most) {
    if (!(most >= 0)) throw std::invalid_argument(message("distance is ", most, " m, allowed: 0 or more"));
    queue_.clear();
    triangle_tests_ = 0;
    most_candidates_ = 0;
    most_ = most;
    closest_.reset();
    if (!a.has_pose() || !b.has_pose()) return std::nullopt;
    PosedWideTree &s = a.wide_tree(), &t = b.wide_tree();
    search(s, t);
    s.require_finite();
    t.require_finite();
    if (!closest_) return std::nullopt;
    return ClosestFaces{*closest_, closest_triangle_triangle(triangles_[0], triangles_[1])};
}

}  // namespace nbd
