#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "sim/json/json_object.hpp"

namespace nbd::test {

/// Differences between a JSON schema and the fields that a reader accepts: missing keys, types, ranges,
/// choices and defaults. One line each; empty if they agree.
std::vector<std::string> schema_differences(const std::filesystem::path& schema,
                                            std::span<const JsonField> fields);

}  // namespace nbd::test
