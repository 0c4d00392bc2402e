#pragma once

#include <filesystem>

#include "meshing/surface/mesh.hpp"

namespace nbd {

/// Writes a .obj or binary .ply file, by extension, with every coordinate rounded to float32, which
/// read_surface() reads back; in double precision where float32 would be too coarse, see far_origin(). The
/// file is written under a temporary name, flushed and renamed, so `path` never holds a partial file. Throws
/// a one-line std::runtime_error with the path for another extension or if writing fails.
void write_surface(const std::filesystem::path& path, NodesRef X, FacesRef F);

}  // namespace nbd
