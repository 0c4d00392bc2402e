#pragma once

#include <string>

#include "sim/scene/scene.hpp"
#include "tests/support/error_of.hpp"

namespace nbd::test {

/// A scene with one body, further keys in the body, and further top-level keys.
inline std::string with(const std::string& in_body, const std::string& beside = "") {
    return R"({"bodies": [{"body": "a.h5")" + (in_body.empty() ? "" : ", " + in_body) + "}]" +
           (beside.empty() ? "" : ", " + beside) + "}";
}

/// Error message of parse_scene for a text; empty if the text is valid.
inline std::string complaint(const std::string& text) {
    return refusal([&] { parse_scene(text, "folder"); });
}

}  // namespace nbd::test
