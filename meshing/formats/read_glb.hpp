#pragma once

#include <filesystem>

#include "meshing/formats/polygon_soup.hpp"

namespace nbd {

/// The triangles of the scene of a .glb file (glTF 2.0), node by node with their transforms, in metres and
/// with z up: glTF has y up, and (x, y, z) of it becomes (x, -z, y). Points and lines are skipped; skins and
/// morph targets are left at rest. Throws std::runtime_error for a damaged file, for data in other files, for
/// nodes nested more than 1000 deep, and for a required extension that changes surfaces, other than
/// KHR_mesh_quantization.
PolygonSoup read_glb(const std::filesystem::path& path);

}  // namespace nbd
