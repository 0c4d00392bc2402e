#pragma once

#include <algorithm>
#include <charconv>
#include <cmath>
#include <concepts>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>

#include "collision/base/shortened.hpp"

namespace nbd {

/// The beginning of a word of a file, for a message; control characters and those beyond ASCII become "?".
inline std::string printable(std::string_view word) {
    std::string text = shortened(word, 40);
    std::ranges::replace_if(
        text, [](char c) { return c < ' ' || c > '~'; }, '?');
    return text;
}

/// The word in capitals, by ASCII alone.
inline std::string capitals(std::string_view word) {
    std::string text(word);
    for (char& c : text)
        if (c >= 'a' && c <= 'z') c = static_cast<char>(c - 'a' + 'A');
    return text;
}

/// A text as a cell of CSV.
inline std::string csv_cell(std::string_view text) {
    if (text.find_first_of(",\"\r\n") == text.npos) return std::string(text);
    std::string quoted = "\"";
    for (const char c : text) quoted += c == '"' ? "\"\"" : std::string(1, c);
    return quoted + '"';
}

/// The number that a word is, with or without a plus; empty if it is none, or an integer that T does not
/// hold. A real number too small for T reads as zero, since programs with wider types write such coordinates,
/// and one too large as infinite.
template <class T>
std::optional<T> number_in(std::string_view word) {
    if (word.starts_with('+')) word.remove_prefix(1);
    T value{};
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error == std::errc::invalid_argument || end != word.data() + word.size()) return std::nullopt;
    if (error == std::errc::result_out_of_range) {
        if constexpr (!std::floating_point<T>) return std::nullopt;
        const std::size_t exponent = word.find_first_of("eE");
        const bool is_tiny = word.substr(0, exponent).find_first_of("123456789") == word.npos ||
                             (exponent != word.npos && word.substr(exponent + 1).starts_with('-'));
        return is_tiny ? T{} : std::numeric_limits<T>::infinity();
    }
    return value;
}

/// The number that a word is as people write it: without a plus; empty if it is none, or one that T does not
/// hold.
template <class T>
std::optional<T> plain_number_in(std::string_view word) {
    T value{};
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error != std::errc() || end != word.data() + word.size()) return std::nullopt;
    return value;
}

/// Whether a word that reads as this number is one too large for its type, and not a written infinity.
inline bool is_too_large(std::string_view word, double number) {
    return std::isinf(number) && word.find_first_of("0123456789") != word.npos;
}

}  // namespace nbd
