#include "training/networks/pose_blocks.hpp"

#include <bit>
#include <numeric>

namespace nbd {
namespace {

/// Rounds to the nearest bfloat16, ties to even.
std::uint32_t bfloat16(float x) {
    const auto bits = std::bit_cast<std::uint32_t>(x);
    return (bits + 0x7fff + (bits >> 16 & 1)) >> 16;
}

}  // namespace

PoseBlocks::PoseBlocks(const PoseRows& inputs, Arithmetic arithmetic, std::uint64_t seed)
    : arithmetic_(arithmetic),
      inputs_(inputs.cols()),
      // Rows a power of two apart would compete for a few sets of the L1 cache.
      stride_((inputs.cols() + 15) / 16 * 16 + 16),
      order_(inputs.rows()) {
    std::iota(order_.begin(), order_.end(), 0);
    shuffle(order_, seed, ~std::uint64_t{0}, 0);
    const std::ptrdiff_t slots = std::ptrdiff_t{blocks()} * block, m = inputs_;
    rows_.setZero(slots * stride_);
    for (std::ptrdiff_t s = 0; s < poses(); ++s) rows_.segment(s * stride_, m) = inputs.row(order_[s]);
    if (arithmetic == Arithmetic::single) return;

    const auto at = [&](std::ptrdiff_t slot, std::ptrdiff_t i) {
        return i < m ? bfloat16(rows_[slot * stride_ + i]) : 0;
    };
    paired_rows_.resize(slots * pairs());
    paired_slots_.setZero(slots / 2 * stride_);
    for (std::ptrdiff_t s = 0; s < slots; ++s)
        for (std::ptrdiff_t i = 0; i < m; i += 2)
            paired_rows_[s * pairs() + i / 2] = at(s, i) | at(s, i + 1) << 16;
    for (std::ptrdiff_t s = 0; s < slots; s += 2)
        for (std::ptrdiff_t i = 0; i < m; ++i)
            paired_slots_[s / 2 * stride_ + i] = at(s, i) | at(s + 1, i) << 16;
}

}  // namespace nbd
