#include "collision/wide_tree/wide_walk.hpp"

#include <algorithm>
#include <bit>
#include <limits>

namespace nbd {
namespace {

/// Boxes of one node or leaf and a box around them.
struct Side {
    const BoxPack& boxes;
    unsigned present;  // bits of the lanes in use
    const Box& whole;
    const OrientedBoxes* oriented = nullptr;  // the same boxes; null: not known
};

/// The children of a node, which were asked for before.
template <class Level>
Side side(PosedWideTree& body, int node) {
    const PosedWideTree::Children& children = Level::children(body, node);
    return {children.boxes, Level::present(body, node), children.whole,
            children.are_oriented ? &children.oriented : nullptr};
}

/// Calls f(i, j) for each box i of s and j of t that are near each other. Returns the number of boxes
/// compared, at most.
template <class F>
long near_pairs(const Side& s, const Side& t, const Within& near, const F& f) {
    std::uint16_t masks[tree_width];
    const unsigned lanes = near.pairs(s.boxes, s.present, s.whole, t.boxes, t.present, t.whole, masks);
    if (s.oriented && t.oriented) near.clear_parted(*s.oriented, *t.oriented, lanes, masks);
    for_each_bit(lanes, [&](int i) { for_each_bit(masks[i], [&](int j) { f(i, j); }); });
    return tree_width * (2 + std::popcount(lanes));
}

/// Nodes that will be fitted soon are prefetched some pairs ahead.
template <class Pair, class OneOfA, class OneOfB>
void prefetch_ahead(const std::vector<Pair>& coming, std::size_t k, const OneOfA& one_of_a,
                    const OneOfB& one_of_b) noexcept {
    constexpr std::size_t ahead = 4;
    if (k + ahead >= coming.size()) return;
    one_of_a(coming[k + ahead].a);
    one_of_b(coming[k + ahead].b);
}

/// Appends the pairs of children near each other of pairs of nodes of one level. child_test(a, b): the test
/// for children of these nodes. Returns the number of boxes compared, at most.
template <class Level, class Taken, class ChildTest>
long open_pairs(PosedWideTree& a, PosedWideTree& b, const std::vector<NodePair>& pairs, const Taken& taken,
                const ChildTest& child_test, std::vector<NodePair>& children) {
    long compared = 0;
    for (std::size_t k = 0; k < pairs.size(); ++k) {
        prefetch_ahead(
            pairs, k, [&](int i) { Level::prefetch(a, i); }, [&](int i) { Level::prefetch(b, i); });
        const NodePair& pair = pairs[k];
        const Within near = child_test(pair.a, pair.b);
        // Boxes change, and mostly shrink, when their children are fitted.
        const auto are_near = [&] { return near.boxes(Level::box(a, pair.a), Level::box(b, pair.b)); };
        if (!are_near()) continue;
        Level::children(a, pair.a);
        if (!are_near()) continue;
        Level::children(b, pair.b);  // may move those of a, if both are one body
        compared += near_pairs(side<Level>(a, pair.a), side<Level>(b, pair.b), near, [&](int i, int j) {
            if (taken.children(pair.a, pair.b, i, j))
                children.push_back({Level::first_child(a, pair.a) + i, Level::first_child(b, pair.b) + j});
        });
    }
    return compared;
}

/// Which pairs a walk over two bodies takes: all.
struct TwoBodies {
    static bool children(int, int, int, int) noexcept { return true; }
    static bool faces(int, int) noexcept { return true; }
};

/// Which pairs a walk over one body with itself takes: every pair of parts once, and no faces that share a
/// vertex or are among those left out.
class OneBody {
 public:
    /// left_out: null for none.
    OneBody(const PosedWideTree& body, const FacePairSet* left_out) noexcept
        : body_(body), left_out_(left_out) {}

    /// Whether to take children i and j of nodes a and b.
    static bool children(int a, int b, int i, int j) noexcept { return a != b || i <= j; }
    /// Whether to take the faces in two slots. A face shares vertices with itself.
    bool faces(int slot_a, int slot_b) const noexcept {
        const std::array<int, 3> s = body_.face_vertices(slot_a), t = body_.face_vertices(slot_b);
        for (const int v : s)
            if (v == t[0] || v == t[1] || v == t[2]) return false;
        return !(left_out_ && left_out_->contains(body_.face(slot_a), body_.face(slot_b)));
    }

 private:
    const PosedWideTree& body_;
    const FacePairSet* left_out_;
};

}  // namespace

template <class Taken>
void WideWalk::find_clusters(PosedWideTree& a, PosedWideTree& b, const Within& near, const Taken& taken) {
    const auto present = [](const PosedWideTree& boxes, int pack) {
        const int left = boxes.tree().clusters() - pack * tree_width;
        return left >= tree_width ? 0xffffu : (1u << left) - 1;
    };
    near_a_.resize(a.cluster_packs());
    near_b_.resize(b.cluster_packs());
    near.all(a.cluster_boxes(), a.cluster_packs(), b.whole(), near_a_.data());
    for (int pa = 0; pa < a.cluster_packs(); ++pa)
        for_each_bit(near_a_[pa] & present(a, pa), [&](int i) {
            const int cluster = tree_width * pa + i;
            near.all(b.cluster_boxes(), b.cluster_packs(), a.cluster(cluster), near_b_.data());
            counters_.node_tests += tree_width * b.cluster_packs();
            for (int pb = 0; pb < b.cluster_packs(); ++pb)
                for_each_bit(near_b_[pb] & present(b, pb), [&](int j) {
                    if (taken.children(0, 0, cluster, tree_width * pb + j))
                        clusters_.push_back({cluster, tree_width * pb + j});
                });
        });
}

template <class Taken, class LeafTest>
void WideWalk::find_leaves(PosedWideTree& a, PosedWideTree& b, const Within& near, const Taken& taken,
                           const LeafTest& leaf_test) {
    find_clusters(a, b, near, taken);
    counters_.node_tests += open_pairs<ClusterLevel>(
        a, b, clusters_, taken, [&](int, int) { return near; }, blocks_);
    counters_.node_tests += open_pairs<BlockLevel>(a, b, blocks_, taken, leaf_test, leaves_);
    counters_.leaf_pairs = leaves_.size();
    counters_.most_pairs = std::max({clusters_.size(), blocks_.size(), leaves_.size()});
}

template <class Taken>
void WideWalk::find_faces(PosedWideTree& a, PosedWideTree& b, const Taken& taken, std::size_t enough,
                          std::vector<FacePair>& pairs) {
    const Within near(distance_);
    for (std::size_t& k = next_leaves_; k < leaves_.size() && pairs.size() < enough; ++k) {
        prefetch_ahead(
            leaves_, k, [&](int i) { a.prefetch_leaf(i); }, [&](int i) { b.prefetch_leaf(i); });
        const NodePair& pair = leaves_[k];
        a.leaf(pair.a);
        b.leaf(pair.b);  // may move the first one, if both are one body
        const PosedWideTree::Leaf &s = a.leaf(pair.a), &t = b.leaf(pair.b);
        counters_.box_tests +=
            near_pairs(Side{s.boxes, a.present_faces(pair.a), s.whole},
                       Side{t.boxes, b.present_faces(pair.b), t.whole}, near, [&](int i, int j) {
                           const FacePair slots{tree_width * pair.a + i, tree_width * pair.b + j};
                           if (taken.children(pair.a, pair.b, i, j) && taken.faces(slots.a, slots.b))
                               pairs.push_back(slots);
                       });
    }
}

bool WideWalk::begin(const PosedWideTree& a, const PosedWideTree& b, float distance) {
    counters_ = {};
    distance_ = distance;
    clusters_.clear();
    blocks_.clear();
    leaves_.clear();
    next_leaves_ = 0;
    return a.has_pose() && b.has_pose() && !apart(a.whole(), b.whole(), distance);
}

template <class Taken>
void WideWalk::begin_leaves(PosedWideTree& a, PosedWideTree& b, float distance, const Taken& taken) {
    if (!begin(a, b, distance)) return;
    const Within near(distance);
    find_leaves(a, b, near, taken, [&](int, int) { return near; });
}

void WideWalk::near_faces(PosedWideTree& a, PosedWideTree& b, float distance, std::vector<FacePair>& pairs) {
    begin_leaves(a, b, distance, TwoBodies{});
    constexpr std::size_t all = std::numeric_limits<std::size_t>::max();
    find_faces(a, b, TwoBodies{}, all, pairs);
}

std::span<const LeafPair> WideWalk::near_leaves(PosedWideTree& a, PosedWideTree& b, float distance,
                                                const BlockReach& reach) {
    if (begin(a, b, distance))
        find_leaves(a, b, Within(distance), TwoBodies{},
                    [&](int block_a, int block_b) { return Within(reach(block_a, block_b)); });
    return leaves_;
}

void WideWalk::reserve(int packs, std::size_t pairs) {
    for (auto* bits : {&near_a_, &near_b_}) bits->reserve(packs);
    for (auto* level : {&clusters_, &blocks_, &leaves_}) level->reserve(pairs);
}

void WideWalk::begin_one_body(PosedWideTree& body, float distance) {
    begin_leaves(body, body, distance, OneBody(body, nullptr));
}

void WideWalk::begin_one_body(PosedWideTree& body, float distance, const LeafPairSet& known,
                              std::span<const LeafPair> open) {
    begin_one_body(body, distance);
    known.remove_from(leaves_);
    leaves_.insert(leaves_.end(), open.begin(), open.end());
}

LeafPairSet::LeafPairSet(int blocks, std::span<const LeafPair> pairs) {
    std::vector<LeafPair> of_blocks;
    for (const LeafPair& pair : pairs) of_blocks.push_back({pair.a / tree_width, pair.b / tree_width});
    std::ranges::sort(of_blocks);
    of_blocks.erase(std::unique(of_blocks.begin(), of_blocks.end()), of_blocks.end());
    begin_.assign(blocks + 1, 0);
    for (const LeafPair& pair : of_blocks) {
        ++begin_[pair.a + 1];
        others_.push_back(pair.b);
    }
    for (int block = 0; block < blocks; ++block) begin_[block + 1] += begin_[block];
    masks_.assign(others_.size(), {});
    for (const LeafPair& pair : pairs) {
        const Mask* mask = find(pair.a / tree_width, pair.b / tree_width);
        masks_[mask - masks_.data()][pair.a % tree_width] |= 1u << pair.b % tree_width;
    }
}

const LeafPairSet::Mask* LeafPairSet::find(int block_a, int block_b) const noexcept {
    const auto first = others_.begin() + begin_[block_a], last = others_.begin() + begin_[block_a + 1];
    const auto found = std::lower_bound(first, last, block_b);
    return found != last && *found == block_b ? masks_.data() + (found - others_.begin()) : nullptr;
}

void LeafPairSet::remove_from(std::vector<LeafPair>& pairs) const {
    LeafPair blocks{-1, -1};
    const Mask* mask = nullptr;
    std::erase_if(pairs, [&](const LeafPair& pair) {
        if (const LeafPair of{pair.a / tree_width, pair.b / tree_width}; of != blocks) {
            blocks = of;
            mask = find(of.a, of.b);
        }
        return mask && ((*mask)[pair.a % tree_width] >> pair.b % tree_width & 1) != 0;
    });
}

bool WideWalk::next_near_faces(PosedWideTree& body, const FacePairSet* left_out, std::size_t enough,
                               std::vector<FacePair>& pairs) {
    find_faces(body, body, OneBody(body, left_out), enough, pairs);
    return next_leaves_ < leaves_.size();
}

}  // namespace nbd
