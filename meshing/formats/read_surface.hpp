#pragma once

#include <filesystem>

#include "meshing/surface/mesh.hpp"

namespace nbd {

/// Triangles of a .obj, .ply, .stl, .off or .glb file (by extension, in either case), metres as they stand.
/// Groups and objects are put together in the file's order, instances with their transforms. Faces keep the
/// file's order, a polygon's triangles standing in its place; lines and points are left out. Vertices at
/// exactly equal positions are welded; they are numbered as they first appear in the file, for .obj and
/// .stl as they first appear in faces. Every coordinate is a float32 number.
/// What is read may still be open, degenerate and so on: see check_surface().
/// Throws std::runtime_error, one line that starts with the path, on a missing, empty or unreadable file,
/// a directory, an unknown extension, a file that ends early where the format lets one know, a face index
/// out of range, a coordinate that is not finite, and a file without faces.
TriMesh read_surface(const std::filesystem::path& path);

}  // namespace nbd
