#include "collision/base/file_name.hpp"

#include <algorithm>
#include <cctype>
#include <string>

namespace nbd {

bool has_extension(const std::filesystem::path& path, std::string_view extension) {
    const std::string has = path.extension().string();
    return std::ranges::equal(has, extension, [](unsigned char a, char b) { return std::tolower(a) == b; });
}

}  // namespace nbd
