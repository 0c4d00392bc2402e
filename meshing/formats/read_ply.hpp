#pragma once

#include <filesystem>

#include "meshing/formats/polygon_soup.hpp"

namespace nbd {

/// Positions and faces of a .ply file, ascii or binary of either byte order; other elements and properties
/// are passed over. Read here and not by assimp, whose reader hangs or aborts on files that end early.
/// Throws std::runtime_error that says what is wrong and in which element.
PolygonSoup read_ply(const std::filesystem::path& path);

}  // namespace nbd
