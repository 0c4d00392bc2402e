#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "sim/json/json_object.hpp"

namespace nbd::test {

/// How a JSON schema and the keys that a reader asked for differ: keys that one of them lacks, types, ranges,
/// choices and defaults. One line each; empty: they agree.
std::vector<std::string> schema_differences(const std::filesystem::path& schema,
                                            std::span<const JsonField> fields);

}  // namespace nbd::test
