#include "apps/bench/pairs/point_boxes.hpp"

#include <algorithm>
#ifdef __AVX__
#include <immintrin.h>
#endif

namespace nbd {
namespace {

using Point = Eigen::Map<const Eigen::Array4f>;
using TwoPoints = Eigen::Array<float, 8, 1>;

/// Loads two points into one vector, without Eigen's detour through memory.
TwoPoints two_points(const float* first, const float* second) noexcept {
    TwoPoints points;
#ifdef __AVX__
    const __m256 low = _mm256_castps128_ps256(_mm_loadu_ps(first));
    _mm256_store_ps(points.data(), _mm256_insertf128_ps(low, _mm_loadu_ps(second), 1));
#else
    points << Point(first), Point(second);
#endif
    return points;
}

}  // namespace

void PointBoxes::add(std::span<const int> points) {
    for (const int p : points)
        if (3 * p != last_)
            floats_.push_back(3 * p);
        else
            with_last_.push_back(size());
    ends_.push_back(floats_.size());
}

Box PointBoxes::box(int list, const float* x) const noexcept {
    const std::size_t i = list;
    const int *p = floats_.data() + (i == 0 ? 0 : ends_[i - 1]), *end = floats_.data() + ends_[i];
    // Several independent minima, so that none waits for the one before.
    constexpr int chains = 4;
    constexpr float inf = std::numeric_limits<float>::infinity();
    TwoPoints lo[chains], hi[chains];
    for (int c = 0; c < chains; ++c) {
        lo[c].setConstant(inf);
        hi[c].setConstant(-inf);
    }
    for (; end - p >= 2 * chains; p += 2 * chains)
        for (int c = 0; c < chains; ++c) {
            const TwoPoints points = two_points(x + p[2 * c], x + p[2 * c + 1]);
            lo[c] = lo[c].min(points);
            hi[c] = hi[c].max(points);
        }
    const TwoPoints low = lo[0].min(lo[1]).min(lo[2].min(lo[3]));
    const TwoPoints high = hi[0].max(hi[1]).max(hi[2].max(hi[3]));
    Box box{low.head<4>().min(low.tail<4>()), high.head<4>().max(high.tail<4>())};
    for (; p < end; ++p) {
        box.lo = box.lo.min(Point(x + *p));
        box.hi = box.hi.max(Point(x + *p));
    }
    if (std::ranges::binary_search(with_last_, list)) {
        const Eigen::Array4f point(x[last_], x[last_ + 1], x[last_ + 2], 0);
        box.lo = box.lo.min(point);
        box.hi = box.hi.max(point);
    }
    box.lo[3] = box.hi[3] = 0;
    return box;
}

}  // namespace nbd
