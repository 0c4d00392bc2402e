#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <numeric>
#include <vector>

#include "meshing/parallel/parallel_for.hpp"

namespace nbd {

/// Calls part(begin, size) for consecutive parts of [0, size), in parallel.
template <class Part>
void for_parts(Eigen::Index size, const Part& part) {
    constexpr Eigen::Index per_part = 8192;
    parallel_for(
        static_cast<int>((size + per_part - 1) / per_part),
        [&](int k) { part(k * per_part, std::min(per_part, size - k * per_part)); }, 1);
}

/// The sum of sum(begin, size) over parts of [0, size), in a fixed order.
template <class Sum>
double sum_parts(Eigen::Index size, const Sum& sum) {
    constexpr Eigen::Index per_part = 8192;
    std::vector<double> sums(static_cast<std::size_t>((size + per_part - 1) / per_part));
    parallel_for(
        sums.size(), [&](int k) { sums[k] = sum(k * per_part, std::min(per_part, size - k * per_part)); }, 1);
    return std::accumulate(sums.begin(), sums.end(), 0.0);
}

}  // namespace nbd
