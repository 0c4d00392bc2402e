#pragma once

#include <string>
#include <string_view>

namespace nbd {

/// The text, or its beginning and "..." if it has more than `longest` bytes; no character of UTF-8 is cut
/// apart.
inline std::string shortened(std::string_view text, std::size_t longest) {
    if (text.size() <= longest) return std::string(text);
    std::size_t end = longest;
    while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xC0U) == 0x80U) --end;
    return std::string(text.substr(0, end)) + "...";
}

}  // namespace nbd
