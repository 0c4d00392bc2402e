#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "collision/base/counter_random.hpp"

namespace nbd {

/// Fisher-Yates shuffle in place. Depends on (seed, stream, round) alone. Uses counters from 2^32 on; lower
/// ones are reserved for initial weights.
inline void shuffle(std::vector<int>& order, std::uint64_t seed, std::uint64_t stream, int round) {
    const std::uint64_t first = (static_cast<std::uint64_t>(round) + 1) << 32;
    for (std::size_t i = order.size(); i-- > 1;) {
        const int j = counter_index(seed, stream, first + i, static_cast<int>(i) + 1);
        std::swap(order[i], order[j]);
    }
}

}  // namespace nbd
