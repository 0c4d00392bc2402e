#pragma once

#include <span>
#include <string>

#include "meshing/h5/reader.hpp"
#include "meshing/h5/sha256.hpp"

namespace nbd::h5 {

/// Adds a dataset as SHA-256 sees it: the line "name type shape" ("tets/nodes float64 10 x 3\n"), then the
/// numbers as stored, row-major and little-endian.
void add_dataset(Sha256& hash, const std::string& name, Type type, const Shape& shape, const void* values);

/// Hex SHA-256 of stored datasets in this order, read piece by piece: equal to add_dataset() of each.
std::string content_hash(const Reader& file, std::span<const std::string> datasets);

}  // namespace nbd::h5
