#include "collision/geometry/face_pair_set.hpp"

#include <algorithm>
#include <iterator>
#include <stdexcept>

#include "collision/base/message.hpp"

namespace nbd {

FacePairSet::FacePairSet(std::span<const FacePair> pairs, int face_count) {
    std::vector<FacePair> sorted;
    sorted.reserve(pairs.size());
    for (const FacePair& pair : pairs) {
        const auto [a, b] = std::minmax(pair.a, pair.b);
        if (a < 0 || b >= face_count)
            throw std::invalid_argument(message("the pair (", pair.a, ", ", pair.b,
                                                ") is of faces that are not there; allowed: 0 to ",
                                                face_count - 1));
        sorted.push_back({a, b});
    }
    if (!std::ranges::is_sorted(sorted)) std::ranges::sort(sorted);
    sorted.erase(std::unique(sorted.begin(), sorted.end()), sorted.end());
    others_.reserve(sorted.size());
    begin_.reserve(static_cast<std::size_t>(face_count) + 1);
    for (int face = 0; face < face_count; ++face) {
        begin_.push_back(others_.size());
        while (others_.size() < sorted.size() && sorted[others_.size()].a == face)
            others_.push_back(sorted[others_.size()].b);
    }
    begin_.push_back(others_.size());
}

bool FacePairSet::contains(int a, int b) const noexcept {
    const std::size_t least = std::min(a, b);
    const int most = std::max(a, b);
    std::span<const int> others(others_.data() + begin_[least], others_.data() + begin_[least + 1]);
    // Halves a long list. All of a short one is read at once, which is faster than a search with branches.
    while (others.size() > 64) {
        const std::size_t middle = others.size() / 2;
        others = others[middle] <= most ? others.subspan(middle) : others.first(middle);
    }
    int found = 0;
    for (const int other : others) found |= other == most;
    return found != 0;
}

long missing_pairs(std::span<const FacePair> exact, std::span<const FacePair> found) {
    std::vector<FacePair> missing;
    std::ranges::set_difference(exact, found, std::back_inserter(missing));
    return missing.size();
}

}  // namespace nbd
