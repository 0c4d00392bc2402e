#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace nbd {

/// Numbers as whole steps of a range: number = low + step * value. Each column has a range of its own, from
/// its least number to its largest.
struct Quantised {
    std::vector<double> low, step;      // [columns]
    std::vector<std::uint16_t> values;  // row by row
};

/// Rounds numbers to the nearest step, so that each is off by half a step at most. numbers: row by row, a
/// multiple of `columns`. steps: of each range, 1 to 65535. Throws std::invalid_argument on a number that is
/// not finite.
Quantised quantise(std::span<const float> numbers, int columns, int steps = 65535);

}  // namespace nbd
