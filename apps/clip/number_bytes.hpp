#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <ostream>
#include <span>
#include <string>

namespace nbd {

/// Writes numbers of four bytes in the byte order of a file format.
template <std::endian order, class Number>
void write_numbers(std::ostream& out, std::span<const Number> numbers) {
    static_assert(sizeof(Number) == 4);
    std::string bytes;
    bytes.reserve(4 * numbers.size());
    for (const Number number : numbers) {
        auto raw = std::bit_cast<std::array<char, 4>>(number);
        if constexpr (order != std::endian::native) std::ranges::reverse(raw);
        bytes.append(raw.data(), raw.size());
    }
    out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
}

template <std::endian order, class Number>
void write_number(std::ostream& out, Number number) {
    write_numbers<order>(out, std::span<const Number>(&number, 1));
}

}  // namespace nbd
