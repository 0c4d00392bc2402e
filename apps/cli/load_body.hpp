#pragma once

#include <filesystem>
#include <string>

#include "meshing/body/body.hpp"
#include "training/files/surface_body.hpp"
#include "training/files/tree_file.hpp"

namespace nbd {

/// What training needs of a body, in float32. Modes are carried along if the body has them.
SurfaceBody surface_body(const Body& body);

/// The tree in a file, of the body in another. hash: body_hash() of that body. Throws std::runtime_error as
/// load_tree(), and with both paths where the tree is of another body.
TreeFile load_tree_of(const std::filesystem::path& body, const std::string& hash,
                      const std::filesystem::path& tree);

/// Throws std::runtime_error with both paths unless the bodies have identical tetrahedra, so that a recording
/// of one moves the other as well.
void check_same_tets(const std::filesystem::path& path, const TetMesh& tets,
                     const std::filesystem::path& other_path, const TetMesh& other);

}  // namespace nbd
