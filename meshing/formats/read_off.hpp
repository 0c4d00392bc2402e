#pragma once

#include <filesystem>

#include "meshing/formats/polygon_soup.hpp"

namespace nbd {

/// Positions and faces of a text .off file; colours, normals and texture coordinates are passed over. Read
/// here and not by assimp, whose reader moves an index out of range into it and makes room for whatever
/// number of faces a damaged header promises.
/// Throws std::runtime_error that says what is wrong and in which vertex or face.
PolygonSoup read_off(const std::filesystem::path& path);

}  // namespace nbd
