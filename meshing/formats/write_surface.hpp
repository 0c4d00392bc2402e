#pragma once

#include <filesystem>

#include "meshing/surface/mesh.hpp"

namespace nbd {

/// Writes a .obj or a binary .ply file, by extension, with every coordinate rounded to float32: what
/// read_surface() gives back. Written under a temporary name, flushed and renamed, so that a file under
/// `path` is whole.
/// Throws std::runtime_error, one line with the path, on another extension or where writing fails.
void write_surface(const std::filesystem::path& path, NodesRef X, FacesRef F);

}  // namespace nbd
