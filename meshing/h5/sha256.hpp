#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <string_view>

namespace nbd::h5 {

/// SHA-256 of a stream of bytes, fed piece by piece.
class Sha256 {
 public:
    Sha256();
    ~Sha256();
    void add(std::span<const std::byte> bytes);
    /// 64 lower-case hex digits. Call once.
    std::string hex();

 private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

/// Hex SHA-256 of a text.
std::string text_sha256(std::string_view text);

/// Hex SHA-256 of a file's bytes, as sha256sum prints it. Throws std::runtime_error with path and reason.
std::string file_sha256(const std::filesystem::path& path);

}  // namespace nbd::h5
