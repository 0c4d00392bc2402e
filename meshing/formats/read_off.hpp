#pragma once

#include <filesystem>

#include "meshing/formats/polygon_soup.hpp"

namespace nbd {

/// Reads positions and faces of a text .off file; skips colours, normals and texture coordinates. Replaces
/// assimp's reader, which moves an out-of-range index into range and allocates any number of faces that a
/// damaged header claims. Throws std::runtime_error with the problem and its vertex or face.
PolygonSoup read_off(const std::filesystem::path& path);

}  // namespace nbd
