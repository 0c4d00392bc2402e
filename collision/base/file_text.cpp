#include "collision/base/file_text.hpp"

#include <cerrno>
#include <cstring>
#include <fstream>
#include <stdexcept>
#include <system_error>
#include <vector>

namespace nbd {
namespace {

[[noreturn]] void fail(const std::filesystem::path& path, const std::string& why) {
    throw std::runtime_error(path.string() + ": cannot be read: " + why);
}

}  // namespace

void require_regular_file(const std::filesystem::path& path) {
    std::error_code error;
    const std::filesystem::file_status status = std::filesystem::status(path, error);
    if (status.type() == std::filesystem::file_type::not_found)
        throw std::runtime_error(path.string() + ": no such file");
    if (error) fail(path, error.message());
    if (std::filesystem::is_directory(status)) fail(path, "it is a folder");
    if (!std::filesystem::is_regular_file(status))
        fail(path, "it is a special file; allowed: a regular file");
}

std::string file_text(const std::filesystem::path& path) {
    require_regular_file(path);
    errno = 0;
    std::ifstream file(path, std::ios::binary);
    if (!file) fail(path, std::strerror(errno));
    std::string text;
    std::vector<char> piece(std::size_t{1} << 16);
    while (file.read(piece.data(), piece.size()) || file.gcount() > 0)
        text.append(piece.data(), file.gcount());
    if (file.bad()) fail(path, std::strerror(errno));
    return text;
}

}  // namespace nbd
