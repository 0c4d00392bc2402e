#pragma once

#include <filesystem>

#include "meshing/formats/polygon_soup.hpp"

namespace nbd {

/// The facets of a STL file, text or binary, in its order; normals, names and colours are skipped. A text may
/// have its keywords in capitals and empty lines before "solid", and several solids are joined. A binary file
/// may have more bytes than its facets take; it may begin with "solid", too. Throws std::runtime_error with
/// path, place and reason for anything else.
PolygonSoup read_stl(const std::filesystem::path& path);

}  // namespace nbd
