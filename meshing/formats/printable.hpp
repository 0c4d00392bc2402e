#pragma once

#include <algorithm>
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

}  // namespace nbd
