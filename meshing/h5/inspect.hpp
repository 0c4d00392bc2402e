#pragma once

#include <filesystem>
#include <string>

namespace nbd::h5 {

/// Describes an nbdtree file for a person: format, versions, hash, every group with its attributes, every
/// dataset with shape and type. Reads everything, so every checksum is verified, and recomputes body_sha256
/// if the file lists the hashed datasets. Source files of virtual datasets are checked the same way. If it
/// returns, the file is whole. Throws std::runtime_error with path and item if something is damaged or the
/// file is not an nbdtree file.
std::string inspect(const std::filesystem::path& path);

}  // namespace nbd::h5
