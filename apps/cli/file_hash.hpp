#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace nbd {

/// Hex SHA-256 of a file's bytes. Throws std::runtime_error with path and reason if it cannot be read.
std::string file_hash(const std::filesystem::path& path);
/// Hex SHA-256 of a text.
std::string text_hash(std::string_view text);

}  // namespace nbd
