#include "apps/bench/pairs/streamed_boxes.hpp"

#include <algorithm>
#include <cstddef>
#ifdef __AVX__
#include <immintrin.h>
#endif

namespace nbd {

StreamedBoxes::StreamedBoxes(int point_count, const std::vector<std::vector<int>>& lists)
    : last_(3 * (point_count - 1)), ends_(lists.size() * copies), boxes_(lists.size()) {
    for (std::size_t list = 0; list < lists.size(); ++list)
        for (const int p : lists[list])
            if (3 * p == last_)
                with_last_.push_back(static_cast<int>(list));
            else
                entries_.push_back({3 * p, static_cast<int>(list)});
    std::ranges::stable_sort(entries_, {}, &Entry::first);
}

void StreamedBoxes::add(Ends& ends, const float* point) const noexcept {
#ifdef __AVX__
    const __m256 twice = _mm256_broadcast_ps(reinterpret_cast<const __m128*>(point));
    const __m256 signs = _mm256_setr_ps(0, 0, 0, 0, -0.f, -0.f, -0.f, -0.f);
    _mm256_store_ps(ends.data(), _mm256_max_ps(_mm256_load_ps(ends.data()), _mm256_xor_ps(twice, signs)));
#else
    const Eigen::Map<const Eigen::Array4f> p(point);
    ends.head<4>() = ends.head<4>().max(p);
    ends.tail<4>() = ends.tail<4>().max(-p);
#endif
}

std::span<const Box> StreamedBoxes::boxes(const float* x) noexcept {
    constexpr float inf = std::numeric_limits<float>::infinity();
    std::ranges::fill(ends_, Ends::Constant(-inf));
    const auto of = [&](int list) { return ends_.data() + copies * list; };
    const Entry *entry = entries_.data(), *end = entry + entries_.size();
    for (; end - entry >= copies; entry += copies)
        for (int c = 0; c < copies; ++c) add(of(entry[c].list)[c], x + entry[c].first);
    for (; entry < end; ++entry) add(*of(entry->list), x + entry->first);
    for (std::size_t i = 0; i < boxes_.size(); ++i) {
        const Ends* part = of(static_cast<int>(i));
        const Ends all = part[0].max(part[1]).max(part[2].max(part[3]));
        boxes_[i] = {-all.tail<4>(), all.head<4>()};
        boxes_[i].lo[3] = boxes_[i].hi[3] = 0;
    }
    for (const int list : with_last_) {
        Box& box = boxes_[static_cast<std::size_t>(list)];
        const Eigen::Array4f point(x[last_], x[last_ + 1], x[last_ + 2], 0);
        box = {box.lo.min(point), box.hi.max(point)};
    }
    return boxes_;
}

}  // namespace nbd
