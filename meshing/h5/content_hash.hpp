#pragma once

#include <span>
#include <string>

#include "meshing/h5/reader.hpp"
#include "meshing/h5/sha256.hpp"

namespace nbd::h5 {

/// Adds a dataset to the hash: the line "name type shape" ("tets/nodes float64 10 x 3\n"), then the stored
/// numbers, row-major and little-endian.
void add_dataset(Sha256& hash, const std::string& name, Type type, const Shape& shape, const void* values);

/// Hex SHA-256 of stored datasets in the given order, read in pieces. Equals add_dataset() of each.
std::string content_hash(const Reader& file, std::span<const std::string> datasets);

}  // namespace nbd::h5
