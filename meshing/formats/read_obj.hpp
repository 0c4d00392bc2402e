#pragma once

#include <filesystem>

#include "meshing/formats/polygon_soup.hpp"

namespace nbd {

/// The faces of a Wavefront OBJ file, in its order, and their vertices in the order in which the faces name
/// them. Reads `v` and `f` alone. A vertex has 3 numbers, 4 with a weight that divides the others, or 6 with
/// a colour; a number may have a decimal comma. A corner names a vertex of the file, from 1 on, or from -1
/// back from the last one before the face. A line that ends in a backslash goes on in the next one. Throws
/// std::runtime_error with the line's number, what it holds and what was allowed.
PolygonSoup read_obj(const std::filesystem::path& path);

}  // namespace nbd
