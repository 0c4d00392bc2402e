#pragma once

#include <filesystem>

#include "meshing/formats/polygon_soup.hpp"

namespace nbd {

/// Reads positions, faces and triangle strips of a .ply file, ascii or binary in either byte order; skips
/// other elements and properties. Replaces assimp's reader, which hangs or aborts on truncated files. Throws
/// std::runtime_error with the problem and its element.
PolygonSoup read_ply(const std::filesystem::path& path);

}  // namespace nbd
