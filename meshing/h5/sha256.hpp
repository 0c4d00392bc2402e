#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "meshing/h5/types.hpp"

namespace nbd::h5 {

class Reader;

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

/// Adds a dataset to the hash: the line "name type shape" ("tets/nodes float64 10 x 3\n"), then the stored
/// numbers, row-major and little-endian.
void add_dataset(Sha256& hash, const std::string& name, Type type, const Shape& shape, const void* values);

/// Hex SHA-256 of stored datasets in the given order, read in pieces. Equals add_dataset() of each.
std::string content_hash(const Reader& file, std::span<const std::string> datasets);

}  // namespace nbd::h5
