#include "collision/query/affine_walk.hpp"

#include "collision/kernels/lane_mask.hpp"
#include "collision/query/near_boxes.hpp"

namespace nbd {
namespace {

constexpr int width = WideTree::width;

/// Calls f(i, j) for each box i of s and j of t that are near each other. whole_s, whole_t: boxes around
/// them; in_s, in_t: the lanes in use. Returns the number of boxes compared.
template <class Near, class F>
long near_pairs(const BoxPack& s, const Box& whole_s, unsigned in_s, const BoxPack& t, const Box& whole_t,
                unsigned in_t, const Near& near, const F& f) noexcept {
    const unsigned near_t = near_boxes(s, whole_t, near) & in_s;
    if (near_t == 0) return width;
    const unsigned near_s = near_boxes(t, whole_s, near) & in_t;
    if (near_s == 0) return 2 * width;
    unsigned masks[2 * width];
    long tests = 2 * width;
    near.each(&t, 1, &s, near_t, masks);
    for_each_bit(near_t, [&](int i) {
        tests += width;
        for_each_bit(masks[i] & near_s, [&](int j) { f(i, j); });
    });
    return tests;
}

}  // namespace

template <class Near>
void AffineWalk::find_clusters(AffineBoxes& a, AffineBoxes& b, const Near& near) noexcept {
    const auto present = [](const AffineBoxes& boxes, int pack) {
        const int left = boxes.tree().clusters - pack * width;
        return left >= width ? 0xffffu : (1u << left) - 1;
    };
    near_a_.resize(static_cast<std::size_t>(a.cluster_packs()));
    near_b_.resize(static_cast<std::size_t>(b.cluster_packs()));
    near.all(a.clusters(), a.cluster_packs(), b.whole(), near_a_.data());
    for (int pa = 0; pa < a.cluster_packs(); ++pa)
        for_each_bit(near_a_[static_cast<std::size_t>(pa)] & present(a, pa), [&](int i) {
            const int cluster = width * pa + i;
            near.all(b.clusters(), b.cluster_packs(), a.cluster(cluster), near_b_.data());
            counters_.node_tests += width * b.cluster_packs();
            for (int pb = 0; pb < b.cluster_packs(); ++pb)
                for_each_bit(near_b_[static_cast<std::size_t>(pb)] & present(b, pb), [&](int j) {
                    clusters_.push_back({cluster, width * pb + j});
                });
        });
}

template <class Near>
void AffineWalk::walk(AffineBoxes& a, AffineBoxes& b, const Near& near,
                      std::vector<FacePair>& pairs) noexcept {
    find_clusters(a, b, near);
    for (const Pair& pair : clusters_)
        counters_.node_tests +=
            near_pairs(a.blocks(pair.a), a.cluster(pair.a), a.blocks_in(pair.a), b.blocks(pair.b),
                       b.cluster(pair.b), b.blocks_in(pair.b), near, [&](int i, int j) {
                           blocks_.push_back({width * pair.a + i, width * pair.b + j});
                       });
    constexpr std::size_t ahead = 4;
    for (std::size_t k = 0; k < blocks_.size(); ++k) {
        if (k + ahead < blocks_.size()) {
            a.prefetch_block(blocks_[k + ahead].a);
            b.prefetch_block(blocks_[k + ahead].b);
        }
        const Pair& pair = blocks_[k];
        counters_.node_tests +=
            near_pairs(a.leaves(pair.a), a.block(pair.a), a.leaves_in(pair.a), b.leaves(pair.b),
                       b.block(pair.b), b.leaves_in(pair.b), near, [&](int i, int j) {
                           leaves_.push_back({width * pair.a + i, width * pair.b + j});
                       });
    }
    for (std::size_t k = 0; k < leaves_.size(); ++k) {
        if (k + ahead < leaves_.size()) {
            a.prefetch_leaf(leaves_[k + ahead].a);
            b.prefetch_leaf(leaves_[k + ahead].b);
        }
        const Pair& pair = leaves_[k];
        a.leaf(pair.a);
        b.leaf(pair.b);  // may move the first one, if both are one body
        const AffineBoxes::Leaf &s = a.leaf(pair.a), &t = b.leaf(pair.b);
        counters_.box_tests += near_pairs(s.boxes, s.whole, a.faces_in(pair.a), t.boxes, t.whole,
                                          b.faces_in(pair.b), near, [&](int i, int j) {
                                              pairs.push_back({width * pair.a + i, width * pair.b + j});
                                          });
    }
    counters_.leaf_pairs = static_cast<long>(leaves_.size());
}

void AffineWalk::near_faces(AffineBoxes& a, AffineBoxes& b, float distance,
                            std::vector<FacePair>& pairs) noexcept {
    counters_ = {};
    pairs.clear();
    clusters_.clear();
    blocks_.clear();
    leaves_.clear();
    if (!a.has_pose() || !b.has_pose() || apart(a.whole(), b.whole(), distance)) return;
    if (distance == 0)
        walk(a, b, Overlapping{}, pairs);
    else
        walk(a, b, Within(distance), pairs);
}

}  // namespace nbd
