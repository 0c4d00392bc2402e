#pragma once

#include <algorithm>
#include <charconv>
#include <optional>
#include <string>
#include <string_view>

#include "collision/base/shortened.hpp"

namespace nbd {

/// The beginning of a word of a file, for a message; control characters and those beyond ASCII become "?".
inline std::string printable(std::string_view word) {
    std::string text = shortened(word, 40);
    std::ranges::replace_if(
        text, [](char c) { return c < ' ' || c > '~'; }, '?');
    return text;
}

/// The number that a word is, with or without a plus; empty if it is none, or one that T does not hold.
template <class T>
std::optional<T> number_in(std::string_view word) {
    if (word.starts_with('+')) word.remove_prefix(1);
    T value{};
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error != std::errc() || end != word.data() + word.size()) return std::nullopt;
    return value;
}

}  // namespace nbd
