#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "meshing/body.hpp"
#include "training/surface_body.hpp"

namespace nbd {

/// What training needs of a body, in float32. Modes are carried along if the body has them.
SurfaceBody surface_body(const Body& body);

/// Throws std::runtime_error unless a file can stand under `path`: its folder is there and may be written,
/// and what is there already is an ordinary file and none of the command's inputs. So a long command fails
/// before its work and not after it. inputs: that do not exist, or are empty, are ignored.
void check_output(const std::filesystem::path& path, const std::vector<std::filesystem::path>& inputs);

}  // namespace nbd
