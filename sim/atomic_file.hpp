#pragma once

#include <filesystem>
#include <string_view>

namespace nbd {

/// Replaces the file as a whole: written under a temporary name beside it, flushed to disk, renamed. A
/// reader sees the old content or the new one, never a part. Throws std::runtime_error with path and
/// reason; nothing is left behind then.
void write_file_atomically(const std::filesystem::path& path, std::string_view content);

}  // namespace nbd
