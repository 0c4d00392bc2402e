#pragma once

#include <filesystem>
#include <string_view>

namespace nbd {

/// Whether the name of a file ends in `extension`, for example ".h5", in small letters or capitals.
bool has_extension(const std::filesystem::path& path, std::string_view extension);

}  // namespace nbd
