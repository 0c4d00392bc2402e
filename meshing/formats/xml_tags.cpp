#include "meshing/formats/xml_tags.hpp"

#include <algorithm>

namespace nbd {
namespace {

constexpr std::string_view xml_white = " \t\r\n";

std::size_t past_white(std::string_view text, std::size_t at) {
    return std::min(text.find_first_not_of(xml_white, at), text.size());
}

/// The end of what begins with "<!--" or "<?" at `at`; npos if it has none; `at` itself for a tag.
std::size_t past_comment(std::string_view text, std::size_t at) {
    const auto past = [&](std::string_view closing) {
        const std::size_t end = text.find(closing, at);
        return end == text.npos ? end : end + closing.size();
    };
    const std::string_view rest = text.substr(at, 4);
    if (rest.starts_with("<!--")) return past("-->");
    if (rest.starts_with("<?")) return past("?>");
    if (rest.starts_with("<!")) return past(">");
    return at;
}

}  // namespace

bool next_tag(std::string_view text, std::size_t from, XmlTag& tag) {
    std::size_t at = from;
    for (;;) {
        at = text.find('<', at);
        if (at == text.npos) return false;
        const std::size_t end = past_comment(text, at);
        if (end == at) break;
        if (end == text.npos) return false;
        at = end;
    }
    tag = {};
    tag.begin = at++;
    if (at < text.size() && text[at] == '/') tag.closes = true, ++at;
    const std::size_t name_end = text.find_first_of(" \t\r\n/>", at);
    if (name_end == text.npos || name_end == at) return false;
    tag.name = text.substr(at, name_end - at);
    at = name_end;
    for (;;) {
        at = past_white(text, at);
        if (at >= text.size()) return false;
        if (text[at] == '/') {
            tag.is_empty = true;
            ++at;
            continue;
        }
        if (text[at] == '>') {
            tag.end = at + 1;
            return true;
        }
        const std::size_t key_end = text.find_first_of(" \t\r\n=>", at);
        if (key_end == text.npos || key_end == at) return false;
        const std::string_view key = text.substr(at, key_end - at);
        at = past_white(text, key_end);
        if (at >= text.size() || text[at] != '=') return false;
        at = past_white(text, at + 1);
        if (at >= text.size() || (text[at] != '"' && text[at] != '\'')) return false;
        const std::size_t value_end = text.find(text[at], at + 1);
        if (value_end == text.npos) return false;
        tag.attributes[key] = text.substr(at + 1, value_end - at - 1);
        at = value_end + 1;
    }
}

}  // namespace nbd
