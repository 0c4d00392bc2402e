#pragma once

#include <filesystem>
#include <string>

namespace nbd {

/// Throws std::runtime_error "PATH: no such file" or "PATH: cannot be read: WHY" unless the path is a regular
/// file.
void require_regular_file(const std::filesystem::path& path);

/// The bytes of a regular file. Throws as require_regular_file() does, also where reading fails.
std::string file_text(const std::filesystem::path& path);

}  // namespace nbd
