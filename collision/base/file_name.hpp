#pragma once

#include <filesystem>
#include <string_view>

namespace nbd {

/// Whether the name of a file ends in `extension`, in small letters or capitals. extension: in small letters,
/// for example ".h5".
bool has_extension(const std::filesystem::path& path, std::string_view extension);

}  // namespace nbd
