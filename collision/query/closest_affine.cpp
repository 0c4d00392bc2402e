#include <bit>

#include "collision/bounds/affine/affine_boxes.hpp"
#include "collision/kernels/lane_mask.hpp"
#include "collision/query/closest_query.hpp"
#include "collision/query/least_distance.hpp"
#include "collision/query/near_boxes.hpp"
#include "collision/query/wide_levels.hpp"

namespace nbd {
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
void ClosestQuery::open_children(Candidate::Level children, AffineBoxes& a, int node_a, AffineBoxes& b,
                                 int node_b) {
    Level::children(a, node_a);
    Level::children(b, node_b);  // may move those of a, if both are one body
    const AffineBoxes::Children &s = Level::children(a, node_a), &t = Level::children(b, node_b);
    push_children(children, s.boxes, Level::present(a, node_a), Level::first_child(a, node_a), t.boxes,
                  Level::present(b, node_b), Level::first_child(b, node_b), t.whole);
}

void ClosestQuery::open_leaves(AffineBoxes& a, int leaf_a, AffineBoxes& b, int leaf_b) {
    a.leaf(leaf_a);
    b.leaf(leaf_b);  // may move the first one, if both are one body
    const AffineBoxes::Leaf &s = a.leaf(leaf_a), &t = b.leaf(leaf_b);
    const unsigned in_s = a.present_faces(leaf_a), in_t = b.present_faces(leaf_b);
    // Measuring one near pair right away keeps most other pairs out of the queue.
    const int i = nearest_box(s.boxes, std::popcount(in_s), t.whole),
              j = nearest_box(t.boxes, std::popcount(in_t), s.boxes.box(i));
    const int slot_a = tree_width * leaf_a + i, slot_b = tree_width * leaf_b + j;
    measure({a.face(slot_a), b.face(slot_b)}, a.triangle(slot_a), b.triangle(slot_b));
    push_children(Candidate::faces, s.boxes, in_s, tree_width * leaf_a, t.boxes, in_t, tree_width * leaf_b,
                  t.whole);
}

void ClosestQuery::search_wide(AffineBoxes& a, AffineBoxes& b) {
    if (!a.has_pose() || !b.has_pose()) return;
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
            measure({a.face(pair.a), b.face(pair.b)}, a.triangle(pair.a), b.triangle(pair.b));
    }
}

}  // namespace nbd
