#include "collision/query/self_query.hpp"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "collision/base/message.hpp"
#include "collision/query/narrow_phase.hpp"

namespace nbd {
namespace {

/// Pairs of faces that are tested at a time, at least; their data stay in the cache.
constexpr std::size_t batch_size = 2048;

}  // namespace

void SelfQuery::reserve(const PosedTree& body, std::size_t pairs) {
    walk_.reserve(body.wide_room().packs, pairs);
    for (auto* held : {&batch_, &pairs_}) held->reserve(pairs);
}

template <class Narrow>
void SelfQuery::finish_batch(const PosedWideTree& tree, const Narrow& narrow) {
    const auto held = static_cast<long>(batch_.size());
    counters_.triangle_tests += held;
    counters_.most_pairs = std::max(counters_.most_pairs, held);
    // In the order of faces, on which the rounding of a distance depends.
    for (FacePair& slots : batch_)
        if (tree.face(slots.a) > tree.face(slots.b)) std::swap(slots.a, slots.b);
    narrow(batch_, tree);
    for (const FacePair& slots : batch_) pairs_.push_back({tree.face(slots.a), tree.face(slots.b)});
    batch_.clear();
}

template <class Begin, class Narrow>
std::span<const FacePair> SelfQuery::find_face_pairs(PosedTree& body, float distance, const Begin& begin,
                                                     const Narrow& narrow) {
    require_distance(distance);
    if (left_out_ && left_out_->face_count() != body.tree().faces.rows())
        throw std::invalid_argument(message("the query leaves out pairs of a surface of ",
                                            left_out_->face_count(), " faces, but the body has ",
                                            body.tree().faces.rows()));
    counters_ = {};
    batch_.clear();
    pairs_.clear();
    if (!body.has_pose()) return pairs_;
    PosedWideTree& tree = body.wide_tree();
    const int bounded_before = tree.bounded(), out_of_range_before = tree.out_of_range();
    begin(tree);
    for (bool more = true; more;) {
        more = walk_.next_near_faces(tree, left_out_.get(), batch_size, batch_);
        finish_batch(tree, narrow);
    }
    const QueryCounters of_batches = std::exchange(counters_, walk_.counters());
    counters_.triangle_tests = of_batches.triangle_tests;
    counters_.nodes_bounded = tree.bounded() - bounded_before;
    counters_.nodes_out_of_range = tree.out_of_range() - out_of_range_before;
    counters_.face_pairs = pairs_.size();
    counters_.most_pairs = std::max({counters_.most_pairs, of_batches.most_pairs, counters_.face_pairs});
    tree.require_finite();
    return pairs_;
}

template <class Narrow>
std::span<const FacePair> SelfQuery::find_face_pairs(PosedTree& body, float distance, const Narrow& narrow) {
    return find_face_pairs(
        body, distance, [&](PosedWideTree& tree) { walk_.begin_one_body(tree, distance); }, narrow);
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

std::span<const FacePair> SelfQuery::boxes_within(PosedTree& body, float distance) {
    return find_face_pairs(body, distance, [](std::vector<FacePair>&, const auto&) {});
}

std::span<const FacePair> SelfQuery::boxes_within(PosedTree& body, float distance, const LeafPairSet& known,
                                                  std::span<const LeafPair> open) {
    return find_face_pairs(
        body, distance, [&](PosedWideTree& tree) { walk_.begin_one_body(tree, distance, known, open); },
        [](std::vector<FacePair>&, const auto&) {});
}

std::shared_ptr<const FacePairSet> near_at_rest(VerticesRef X, FacesRef F, float distance) {
    require_distance(distance);
    PosedTree body(shared_exact_tree(X, F), BoundKind::boxes);
    body.begin_pose(VertexView::as_long_as(X));
    return std::make_shared<const FacePairSet>(SelfQuery().within(body, distance), F.rows());
}

}  // namespace nbd
