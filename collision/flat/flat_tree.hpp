#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <vector>

#include "collision/tree/collision_tree.hpp"

// A collision tree as a flat file, for programs that embed the library. Reading it needs only the standard
// library. README.md in this folder describes the format.
namespace nbd {

/// Loads the tree in a flat file. Throws std::runtime_error with path and reason if the file cannot be read,
/// is truncated, damaged, foreign, of an unknown version or another byte order, or its parts do not fit each
/// other.
CollisionTree load_flat_tree(const std::filesystem::path& path);

/// Reads the tree from a file that is in memory already, or mapped into it; copies what it needs. Error texts
/// have no path.
CollisionTree read_flat_tree(std::span<const std::byte> file);

/// Writes a file for load_flat_tree(), which appears under its name complete or not at all; see
/// TemporaryFile. Throws std::runtime_error with path and reason, std::invalid_argument as
/// check_collision_tree().
void save_flat_tree(const std::filesystem::path& path, const CollisionTree& tree);

/// The content of that file.
std::vector<std::byte> write_flat_tree(const CollisionTree& tree);

}  // namespace nbd
