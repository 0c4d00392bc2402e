#pragma once

#include <filesystem>
#include <string>

#include "meshing/body/body.hpp"
#include "training/files/surface_body.hpp"
#include "training/files/tree_file.hpp"

namespace nbd {

/// The body as training needs it, in float32, with modes if the body has them.
SurfaceBody surface_body(const Body& body);

/// Loads the tree in file `tree`, which must belong to the body in file `body`. hash: body_hash() of that
/// body. Throws std::runtime_error as load_tree() does, and with both paths if the tree belongs to another
/// body.
TreeFile load_tree_of(const std::filesystem::path& body, const std::string& hash,
                      const std::filesystem::path& tree);

/// Throws std::runtime_error with both paths unless the bodies have identical tetrahedra, so that a recording
/// of one moves the other as well.
void check_same_tets(const std::filesystem::path& path, const TetMesh& tets,
                     const std::filesystem::path& other_path, const TetMesh& other);

}  // namespace nbd
