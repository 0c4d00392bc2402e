#include "apps/cli/file_hash.hpp"

#include <fmt/core.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <span>
#include <stdexcept>
#include <vector>

#include "meshing/h5/sha256.hpp"

namespace nbd {

std::string text_hash(std::string_view text) {
    h5::Sha256 hash;
    hash.add(std::as_bytes(std::span(text)));
    return hash.hex();
}

std::string file_hash(const std::filesystem::path& path) {
    std::ifstream file(path, std::ios::binary);
    if (!file && (errno == ENOENT || errno == ENOTDIR))
        throw std::runtime_error(fmt::format("{}: no such file", path.string()));
    if (!file || std::filesystem::is_directory(path))
        throw std::runtime_error(fmt::format("{}: cannot be read: {}", path.string(),
                                             file ? "it is a folder" : std::strerror(errno)));
    h5::Sha256 hash;
    std::vector<char> piece(1 << 20);
    while (file.read(piece.data(), static_cast<std::streamsize>(piece.size())) || file.gcount() > 0)
        hash.add(std::as_bytes(std::span(piece.data(), static_cast<std::size_t>(file.gcount()))));
    return hash.hex();
}

}  // namespace nbd
