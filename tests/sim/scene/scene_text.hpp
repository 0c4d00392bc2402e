#pragma once

#include <string>

namespace nbd::test {

/// A scene with one body, further keys in the body, and further top-level keys.
inline std::string with(const std::string& in_body, const std::string& beside = "") {
    return R"({"bodies": [{"body": "a.h5")" + (in_body.empty() ? "" : ", " + in_body) + "}]" +
           (beside.empty() ? "" : ", " + beside) + "}";
}

}  // namespace nbd::test
