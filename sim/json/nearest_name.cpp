#include "sim/json/nearest_name.hpp"

#include <algorithm>
#include <numeric>
#include <utility>

namespace nbd {
namespace {

/// Minimum number of single-letter insertions, deletions and replacements that turn a into b.
std::size_t edit_distance(std::string_view a, std::string_view b) {
    std::vector<std::size_t> row(b.size() + 1);
    std::iota(row.begin(), row.end(), std::size_t{0});
    for (std::size_t i = 0; i < a.size(); ++i) {
        std::size_t diagonal = std::exchange(row[0], i + 1);
        for (std::size_t j = 0; j < b.size(); ++j) {
            const std::size_t replaced = diagonal + (a[i] == b[j] ? 0 : 1);
            diagonal = row[j + 1];
            row[j + 1] = std::min({replaced, diagonal + 1, row[j] + 1});
        }
    }
    return row.back();
}

}  // namespace

const std::string& nearest_name(std::string_view word, const std::vector<std::string>& known) {
    return *std::ranges::min_element(known, {},
                                     [&](const std::string& name) { return edit_distance(word, name); });
}

}  // namespace nbd
