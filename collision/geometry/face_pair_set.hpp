#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "collision/geometry/geometry.hpp"

namespace nbd {

/// Pairs of faces of one surface, without order: (a, b) is the same pair as (b, a). For pairs that a
/// SelfQuery is to leave out; see near_at_rest(). Takes 4 bytes a pair and 8 a face.
class FacePairSet {
 public:
    /// pairs: in any order, with repeats or not. Throws std::invalid_argument, naming the pair, if a face is
    /// not in [0, face_count).
    FacePairSet(std::span<const FacePair> pairs, int face_count);

    bool contains(int a, int b) const noexcept;
    int face_count() const noexcept { return static_cast<int>(begin_.size()) - 1; }
    std::size_t size() const noexcept { return others_.size(); }

 private:
    std::vector<std::size_t> begin_;  // [faces + 1] range of each face in `others_`
    std::vector<int> others_;         // of the pairs (a, b), a <= b: all b, ascending for each a
};

/// Number of exact face pairs that are not among the found ones. Both lists are sorted, without repeats.
long missing_pairs(std::span<const FacePair> exact, std::span<const FacePair> found);

}  // namespace nbd
