#include "collision/query/many_body_query.hpp"

#include <algorithm>
#include <limits>
#include <numeric>

namespace nbd {
namespace {

/// Box around the whole body, as queries walk it. by_boxes: among bodies of which one has boxes.
Box whole(PosedTree& body, bool by_boxes) {
    if (!by_boxes || !body.has_pose()) return body.whole();
    const PosedWideTree& boxes = body.wide_tree();
    boxes.require_finite();
    return boxes.whole();
}

/// Box around all points within distance / 2 of this box, which is around a body if it contains the body. The
/// boxes of two bodies within `distance` of each other touch.
Box root_box(const Box& box, float distance) {
    if ((box.lo > box.hi).any()) return empty_box();  // before the first pose
    // Each side rounds by an ulp of its coordinate or of the distance.
    const Eigen::Array4f ulps =
        4 * std::numeric_limits<float>::epsilon() * (box.lo.abs().max(box.hi.abs()) + distance);
    const Box grown{box.lo - distance / 2 - ulps, box.hi + distance / 2 + ulps};
    if (grown.lo.hasNaN() || grown.hi.hasNaN())
        return {-empty_box().lo, -empty_box().hi};  // overflow: near everything
    return grown;
}

}  // namespace

void ManyBodyQuery::deal_out(std::size_t bodies) {
    order_.clear();
    round_ends_.clear();
    last_round_.assign(bodies, -1);
    waiting_.resize(pairs_.size());
    std::iota(waiting_.begin(), waiting_.end(), 0);
    while (!waiting_.empty()) {
        const int round = rounds();
        std::size_t kept = 0;
        for (const int pair : waiting_) {
            const BodyIndices p = pairs_[pair];
            int& a = last_round_[p.a];
            int& b = last_round_[p.b];
            if (a == round || b == round) {
                waiting_[kept++] = pair;
            } else {
                a = b = round;
                order_.push_back(pair);
            }
        }
        waiting_.resize(kept);
        round_ends_.push_back(order_.size());
    }
}

template <class Task>
void ManyBodyQuery::run_tasks(int count, const Task& task) {
    errors_.assign(count, nullptr);
    const auto guarded = [&](int i) {
        try {
            task(i);
        } catch (...) {
            errors_[i] = std::current_exception();
        }
    };
    executor_(count, std::ref(guarded));  // a reference allocates nothing
    for (const std::exception_ptr& error : errors_)
        if (error) std::rethrow_exception(error);
}

void ManyBodyQuery::reserve(std::span<PosedTree* const> bodies, std::size_t body_pairs, std::size_t pairs) {
    roots_.reserve(bodies.size());
    last_round_.reserve(bodies.size());
    errors_.reserve(std::max(bodies.size(), body_pairs));
    sweep_.reserve(bodies.size(), body_pairs);
    for (auto* numbers : {&order_, &round_ends_, &waiting_}) numbers->reserve(body_pairs);
    answers_.reserve(body_pairs);
    if (queries_.size() < body_pairs) queries_.resize(body_pairs);
    for (PairQuery& query : queries_)
        for (const PosedTree* body : bodies) query.reserve(*body, *body, pairs);
}

template <class Ask>
std::span<const TouchingBodies> ManyBodyQuery::run(std::span<PosedTree* const> bodies, float distance,
                                                   const Ask& ask) {
    roots_.resize(bodies.size());
    const bool by_boxes = std::ranges::any_of(bodies, [](PosedTree* body) { return !body->nbd_tree(); });
    const auto bound_root = [&](int i) {
        const std::size_t body = i;
        roots_[body] = root_box(whole(*bodies[body], by_boxes), distance);
    };
    run_tasks(bodies.size(), bound_root);
    pairs_ = sweep_.touching(roots_);
    deal_out(bodies.size());
    if (queries_.size() < pairs_.size()) queries_.resize(pairs_.size());
    answers_.resize(pairs_.size());
    int begin = 0;
    for (const int end : round_ends_) {
        const auto ask_pair = [&](int i) {
            const std::size_t pair = order_[begin + i];
            const BodyIndices p = pairs_[pair];
            answers_[pair] = {p, ask(queries_[pair], *bodies[p.a], *bodies[p.b])};
        };
        run_tasks(end - begin, ask_pair);
        begin = end;
    }
    std::erase_if(answers_, [](const TouchingBodies& answer) { return answer.faces.empty(); });
    return answers_;
}

std::span<const TouchingBodies> ManyBodyQuery::intersecting(std::span<PosedTree* const> bodies) {
    return run(bodies, 0,
               [](PairQuery& query, PosedTree& a, PosedTree& b) { return query.intersecting(a, b); });
}

std::span<const TouchingBodies> ManyBodyQuery::within(std::span<PosedTree* const> bodies, float distance) {
    return run(bodies, distance, [distance](PairQuery& query, PosedTree& a, PosedTree& b) {
        return query.within(a, b, distance);
    });
}

std::span<const TouchingBodies> ManyBodyQuery::boxes_within(std::span<PosedTree* const> bodies,
                                                            float distance) {
    return run(bodies, distance, [distance](PairQuery& query, PosedTree& a, PosedTree& b) {
        return query.boxes_within(a, b, distance);
    });
}

}  // namespace nbd
