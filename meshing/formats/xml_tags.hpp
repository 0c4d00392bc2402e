#pragma once

#include <map>
#include <string>
#include <string_view>

namespace nbd {

/// A tag of an XML text: <name key="value">, <name/> or </name>.
struct XmlTag {
    std::string_view name;
    std::map<std::string_view, std::string_view> attributes{};
    bool closes = false;             // </name>
    bool is_empty = false;           // <name/>
    std::size_t begin = 0, end = 0;  // in the text; `end` is past the ">"
};

/// Reads the tag at or behind a place of the text. Skips comments, declarations and text between tags, and
/// knows no entities. False at the end, or where the text is none.
bool next_tag(std::string_view text, std::size_t from, XmlTag& tag);

}  // namespace nbd
