#include "apps/view/packed.hpp"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "meshing/formats/base64.hpp"

namespace nbd {
namespace {

/// Small for differences of either sign: 0, -1, 1, -2 become 0, 1, 2, 3.
template <class Word>
Word folded(Word difference) {
    const bool is_negative = (difference >> (8 * sizeof(Word) - 1)) != 0;
    const auto twice = static_cast<Word>(difference << 1);
    return is_negative ? static_cast<Word>(~twice) : twice;
}

/// What remains of numbers after their prediction, modulo the words' range.
template <class Word>
std::vector<Word> remainders(std::span<const Word> numbers, std::size_t row, int stride, int time,
                             bool space) {
    std::vector<Word> result(numbers.size());
    const std::size_t step = stride;
    const auto remainder = [&](std::size_t i) {
        const Word once = time > 0 && i >= row ? numbers[i - row] : Word{0};
        const Word twice =
            time > 1 && i >= 2 * row ? static_cast<Word>(once - numbers[i - 2 * row]) : Word{0};
        return static_cast<Word>(numbers[i] - once - twice);
    };
    for (std::size_t i = 0; i < numbers.size(); ++i) {
        const Word before = space && i % row >= step ? remainder(i - step) : Word{0};
        result[i] = folded(static_cast<Word>(remainder(i) - before));
    }
    return result;
}

/// The lowest bytes of all words, then the next ones, and so on.
template <class Word>
std::vector<unsigned char> byte_planes(std::span<const Word> words) {
    std::vector<unsigned char> bytes;
    bytes.reserve(words.size() * sizeof(Word));
    for (std::size_t plane = 0; plane < sizeof(Word); ++plane)
        for (const Word word : words) bytes.push_back(static_cast<unsigned char>(word >> (8 * plane)));
    return bytes;
}

/// Bits that an ideal code of single bytes takes for planes of equal length.
double bits_needed(std::span<const unsigned char> bytes, std::size_t planes) {
    double bits = 0;
    const std::size_t length = bytes.size() / planes;
    for (std::size_t plane = 0; plane < planes; ++plane) {
        std::array<double, 256> counts{};
        for (const unsigned char byte : bytes.subspan(plane * length, length)) counts[byte] += 1;
        for (const double count : counts)
            if (count > 0) bits -= count * std::log2(count / static_cast<double>(length));
    }
    return bits;
}

std::string deflated(const std::vector<unsigned char>& bytes) {
    uLongf size = compressBound(static_cast<uLong>(bytes.size()));
    std::string result(size, '\0');
    if (compress2(reinterpret_cast<unsigned char*>(result.data()), &size, bytes.data(),
                  static_cast<uLong>(bytes.size()), 6) != Z_OK)
        throw std::runtime_error("zlib cannot compress the numbers of a page");
    result.resize(size);
    return result;
}

template <class Word>
Packed pack_words(std::span<const Word> numbers, std::size_t row, int stride, std::string type) {
    Packed packed{std::move(type), numbers.size(), row, stride, 0, false, {}};
    std::vector<unsigned char> best;
    double least = std::numeric_limits<double>::infinity();
    const int most = numbers.size() > row ? 2 : 0;
    for (int time = 0; time <= most; ++time)
        for (const bool space : {false, true}) {
            auto bytes = byte_planes<Word>(remainders(numbers, row, stride, time, space));
            const double bits = bits_needed(bytes, sizeof(Word));
            if (bits >= least) continue;
            least = bits;
            packed.time = time;
            packed.space = space;
            best = std::move(bytes);
        }
    packed.text = to_base64(deflated(best));
    return packed;
}

}  // namespace

Quantised quantise(std::span<const float> numbers, int columns, int steps) {
    const std::size_t k = columns;
    if (columns < 1 || numbers.size() % k != 0 || steps < 1 || steps > 65535)
        throw std::invalid_argument(fmt::format("{} numbers in {} columns with {} steps cannot be quantised",
                                                numbers.size(), columns, steps));
    std::vector<double> high(k, -std::numeric_limits<double>::infinity());
    Quantised result{
        std::vector<double>(k, std::numeric_limits<double>::infinity()), std::vector<double>(k), {}};
    for (std::size_t i = 0; i < numbers.size(); ++i) {
        if (!std::isfinite(numbers[i]))
            throw std::invalid_argument(
                fmt::format("number {} to be shown is {}; allowed: finite numbers", i, numbers[i]));
        result.low[i % k] = std::min<double>(result.low[i % k], numbers[i]);
        high[i % k] = std::max<double>(high[i % k], numbers[i]);
    }
    for (std::size_t c = 0; c < k; ++c) {
        if (numbers.empty()) result.low[c] = high[c] = 0;
        result.step[c] = (high[c] - result.low[c]) / steps;
    }
    result.values.reserve(numbers.size());
    for (std::size_t i = 0; i < numbers.size(); ++i) {
        const double step = result.step[i % k];
        const double value = step > 0 ? std::round((numbers[i] - result.low[i % k]) / step) : 0;
        result.values.push_back(static_cast<std::uint16_t>(std::clamp<double>(value, 0, steps)));
    }
    return result;
}

Packed pack(std::span<const std::uint16_t> numbers, std::size_t row, int stride) {
    return pack_words(numbers, row, stride, "u16");
}

Packed pack(std::span<const std::uint32_t> numbers, std::size_t row, int stride) {
    return pack_words(numbers, row, stride, "u32");
}

Packed pack(std::span<const float> numbers) {
    std::vector<std::uint32_t> words;
    words.reserve(numbers.size());
    for (const float number : numbers) words.push_back(std::bit_cast<std::uint32_t>(number));
    return {"f32",
            words.size(),
            std::max<std::size_t>(words.size(), 1),
            1,
            0,
            false,
            to_base64(deflated(byte_planes<std::uint32_t>(words)))};
}

}  // namespace nbd
