#include "collision/base/file_text.hpp"

#include <cerrno>
#include <cstring>
#include <fstream>
#include <iterator>
#include <stdexcept>

namespace nbd {

std::string file_text(const std::filesystem::path& path) {
    const auto fail = [&](const std::string& why) {
        throw std::runtime_error(path.string() + ": cannot be read: " + why);
    };
    std::error_code error;
    const std::filesystem::file_status status = std::filesystem::status(path, error);
    if (status.type() == std::filesystem::file_type::not_found)
        throw std::runtime_error(path.string() + ": no such file");
    if (error) fail(error.message());
    if (std::filesystem::is_directory(status)) fail("it is a folder");
    if (!std::filesystem::is_regular_file(status)) fail("it is a special file; allowed: a regular file");
    std::ifstream file(path, std::ios::binary);
    if (!file) fail(std::strerror(errno));
    std::string text{std::istreambuf_iterator<char>(file), {}};
    if (file.bad()) fail(std::strerror(errno));
    return text;
}

}  // namespace nbd
