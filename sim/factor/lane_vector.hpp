#pragma once

#include <cstring>

namespace nbd {

/// How many lanes of a vector register hold R numbers.
template <int R>
requires(R <= 8) constexpr int lanes_of = (R <= 4 ? 4 : 8);

/// R numbers for vector units; further lanes are unspecified.
template <int R>
using LaneVector [[gnu::vector_size(lanes_of<R> * sizeof(float))]] = float;

/// The lanes that are stored at an address.
template <class Lanes>
Lanes load_lanes(const void* at) noexcept {
    Lanes result;
    std::memcpy(&result, at, sizeof result);
    return result;
}

}  // namespace nbd
