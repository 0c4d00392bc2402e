#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "collision/base/counter_random.hpp"
#include "training/networks/mlp.hpp"

namespace nbd {

/// Fisher-Yates shuffle in place. Depends on (seed, stream, round) alone. Uses counters from 2^32 on; lower
/// ones are reserved for initial weights.
inline void shuffle(std::vector<int>& order, std::uint64_t seed, std::uint64_t stream, int round) {
    const std::uint64_t first = (std::uint64_t{1} + round) << 32;
    for (std::size_t i = order.size(); i-- > 1;) {
        const int j = counter_index(seed, stream, first + i, i + 1);
        std::swap(order[i], order[j]);
    }
}

/// Inputs of the training poses in the layouts that training steps read: shuffled once and stored in blocks
/// of 16, which a step takes whole, so that nothing is copied per step. All networks share one object.
class PoseBlocks {
 public:
    static constexpr int block = 16;

    /// inputs: [poses, m], copied. seed: of the shuffle.
    PoseBlocks(const PoseRows& inputs, Arithmetic arithmetic, std::uint64_t seed);

    Arithmetic arithmetic() const noexcept { return arithmetic_; }
    int poses() const noexcept { return order_.size(); }
    int inputs() const noexcept { return inputs_; }
    /// Number of blocks. Slots from poses() on in the last block hold zeros.
    int blocks() const noexcept { return (poses() + block - 1) / block; }
    /// [poses()] row of `inputs` in each slot. A slot's block is slot / 16.
    const std::vector<int>& order() const noexcept { return order_; }

    /// Number of poses in the given blocks.
    int poses_in(std::span<const int> blocks) const noexcept {
        int sum = 0;
        for (const int b : blocks) sum += std::min(block, poses() - b * block);
        return sum;
    }

    /// Floats between two slots of rows().
    std::ptrdiff_t stride() const noexcept { return stride_; }
    /// [16, stride()] inputs of block b, slot by slot.
    const float* rows(int b) const noexcept { return rows_.data() + b * block * stride_; }
    /// Pairs between two slots of paired_rows(): inputs() / 2, rounded up.
    int pairs() const noexcept { return (inputs_ + 1) / 2; }
    /// [16, pairs()] bfloat16 pairs of neighbouring inputs of a slot; only with Arithmetic::mixed.
    const std::uint32_t* paired_rows(int b) const noexcept {
        return paired_rows_.data() + b * block * pairs();
    }
    /// [8, paired_stride()] bfloat16 pairs of one input in neighbouring slots; only with Arithmetic::mixed.
    const std::uint32_t* paired_slots(int b) const noexcept {
        return paired_slots_.data() + b * block / 2 * stride_;
    }
    std::ptrdiff_t paired_stride() const noexcept { return stride_; }

 private:
    Arithmetic arithmetic_;
    int inputs_;
    std::ptrdiff_t stride_;
    std::vector<int> order_;
    // Eigen aligns its arrays to cache lines.
    Eigen::VectorXf rows_;
    Eigen::Matrix<std::uint32_t, Eigen::Dynamic, 1> paired_rows_, paired_slots_;
};

}  // namespace nbd
