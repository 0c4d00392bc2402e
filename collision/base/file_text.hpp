#pragma once

#include <filesystem>
#include <string>

namespace nbd {

/// The bytes of a regular file. Throws std::runtime_error "PATH: no such file" or "PATH: cannot be read:
/// WHY".
std::string file_text(const std::filesystem::path& path);

}  // namespace nbd
