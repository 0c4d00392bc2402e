#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <vector>

#include "collision/tree/collision_tree.hpp"

// A collision tree as a flat file, for programs that embed the library: nothing but the standard library
// reads it. flat/README.md says what stands where.
namespace nbd {

/// The tree in a flat file. Throws std::runtime_error with path and reason where the file cannot be read, is
/// truncated, damaged, foreign, of another version or byte order, or its parts do not fit each other.
CollisionTree load_flat_tree(const std::filesystem::path& path);

/// The same from a file that is in memory already, or mapped into it; not referred to afterwards. The text of
/// an error then goes without a path.
CollisionTree read_flat_tree(std::span<const std::byte> file);

/// What load_flat_tree() reads. Written under another name, `path` with ".partial", and renamed when it is
/// whole. Throws std::runtime_error with path and reason, std::invalid_argument as check_collision_tree().
void save_flat_tree(const std::filesystem::path& path, const CollisionTree& tree);

/// The same as bytes.
std::vector<std::byte> write_flat_tree(const CollisionTree& tree);

}  // namespace nbd
