#include "sim/multilevel/aggregates.hpp"

#include <algorithm>

namespace nbd {
namespace {

constexpr int alone = -1, free_row = -2;

}  // namespace

Aggregates aggregate(const std::vector<std::vector<int>>& strong) {
    const std::size_t rows = strong.size();
    Aggregates result{.of = std::vector<int>(rows, free_row)};
    std::vector<int>& of = result.of;
    for (std::size_t i = 0; i < rows; ++i)
        if (strong[i].size() <= 1) of[i] = alone;
    const auto is_free = [&](int j) { return of[j] == free_row; };
    const auto take = [&](std::size_t i) {
        for (const int j : strong[i])
            if (is_free(j)) of[j] = result.count;
        ++result.count;
    };
    for (std::size_t i = 0; i < rows; ++i)
        if (of[i] == free_row && std::ranges::all_of(strong[i], is_free)) take(i);
    // Rows in between join; they must not attract others before all have joined.
    const std::vector<int> cores = of;
    std::vector<int> votes(result.count, 0);
    for (std::size_t i = 0; i < rows; ++i) {
        if (of[i] != free_row) continue;
        int most = 0;
        for (const int j : strong[i])
            if (const int a = cores[j]; a >= 0)
                if (const int count = ++votes[a]; count > most) {
                    most = count;
                    of[i] = a;
                }
        for (const int j : strong[i])
            if (const int a = cores[j]; a >= 0) votes[a] = 0;
    }
    for (std::size_t i = 0; i < rows; ++i)
        if (of[i] == free_row) take(i);
    return result;
}

}  // namespace nbd
