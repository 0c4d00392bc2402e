#include "apps/bench/measure/read_bandwidth.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <vector>

#include "collision/base/stopwatch.hpp"

namespace nbd {

double read_bandwidth() {
    const std::vector<std::uint64_t> data(std::size_t{64} << 20, 1);
    double best = 0;
    for (int pass = 0; pass < 10; ++pass) {
        const Stopwatch watch;
        const std::uint64_t sum = std::accumulate(data.begin(), data.end(), std::uint64_t{0});
        // The comparison makes the compiler keep the sum.
        if (sum == data.size()) best = std::max(best, static_cast<double>(8 * data.size()) / watch.seconds());
    }
    return best;
}

}  // namespace nbd
