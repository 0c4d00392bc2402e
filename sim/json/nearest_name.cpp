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

/// What other programs and books call our keys.
constexpr std::pair<std::string_view, std::string_view> other_names[] = {
    {"E", "young"},
    {"youngs_modulus", "young"},
    {"young_modulus", "young"},
    {"youngs-modulus", "young"},
    {"elastic_modulus", "young"},
    {"nu", "poisson"},
    {"poisson_ratio", "poisson"},
    {"poissons_ratio", "poisson"},
    {"poisson-ratio", "poisson"},
    {"rho", "density"},
    {"mass_density", "density"},
    {"mu", "friction"},
    {"friction_coefficient", "friction"},
    {"timestep", "dt"},
    {"time_step", "dt"},
    {"g", "gravity"},
    {"position", "translate"},
    {"translation", "translate"},
    {"rotation", "rotate"},
};

/// The known name of a word that others use, behind the same dashes; empty if there is none.
std::string name_of_synonym(std::string_view word, const std::vector<std::string>& known) {
    const std::size_t dashes = std::min(word.find_first_not_of('-'), word.size());
    for (const auto& [other, name] : other_names) {
        if (other != word.substr(dashes)) continue;
        const std::string ours = std::string(word.substr(0, dashes)) + std::string(name);
        if (std::ranges::find(known, ours) != known.end()) return ours;
    }
    return {};
}

}  // namespace

std::string nearest_name(std::string_view word, const std::vector<std::string>& known) {
    if (const std::string ours = name_of_synonym(word, known); !ours.empty()) return ours;
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
