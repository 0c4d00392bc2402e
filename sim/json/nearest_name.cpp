#include "sim/json/nearest_name.hpp"

#include <fmt/format.h>

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

std::string nearest_name(std::string_view word, const std::vector<std::string>& known) {
    const std::size_t letters = word.size() - std::min(word.find_first_not_of('-'), word.size());
    std::string nearest;
    std::size_t least = (letters + 2) / 3 + 1;
    for (const std::string& name : known)
        if (const std::size_t distance = edit_distance(word, name); distance < least) {
            least = distance;
            nearest = name;
        }
    if (!nearest.empty() || letters < 3) return nearest;
    const auto longer =
        std::ranges::find_if(known, [&](const std::string& name) { return name.ends_with(word); });
    return longer == known.end() ? "" : *longer;
}

std::string nearest_hint(std::string_view word, const std::vector<std::string>& known,
                         std::string_view phrase) {
    const std::string nearest = nearest_name(word, known);
    return nearest.empty() ? "" : fmt::format(fmt::runtime(phrase), nearest);
}

}  // namespace nbd
