#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
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

/// Numbers in few letters, as a page holds them: each is predicted from others, the differences are sorted
/// into planes of bytes, deflated (zlib), and written in base 64. page/unpack.js undoes it.
struct Packed {
    std::string type;       // "u16", "u32" or "f32"
    std::size_t count = 0;  // of numbers
    std::size_t row = 0;    // numbers in a row, for instance in a frame
    int stride = 1;         // a number follows the one so many places before it
    int time = 0;           // how many rows before it predict a number: 0; 1, the same; 2, a straight line
    bool space = false;     // whether what remains follows that of the number `stride` places before it
    std::string text;       // base 64
};

/// Packs whole numbers, exactly. Takes the prediction that leaves the least. row, stride: see Packed, >= 1.
Packed pack(std::span<const std::uint16_t> numbers, std::size_t row, int stride);
Packed pack(std::span<const std::uint32_t> numbers, std::size_t row, int stride);

/// Packs numbers in single precision, bit for bit, without prediction.
Packed pack(std::span<const float> numbers);

}  // namespace nbd
