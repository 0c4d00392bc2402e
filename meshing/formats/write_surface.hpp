#pragma once

#include <filesystem>

#include "meshing/surface/mesh.hpp"

namespace nbd {

/// Writes a .obj or binary .ply file, by extension, with every coordinate rounded to float32; read_surface()
/// reads the same numbers back. The file is written under a temporary name, flushed and renamed, so `path`
/// never holds a partial file. Throws a one-line std::runtime_error with the path for another extension or if
/// writing fails.
void write_surface(const std::filesystem::path& path, NodesRef X, FacesRef F);

}  // namespace nbd
