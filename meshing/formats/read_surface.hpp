#pragma once

#include <cstdint>
#include <filesystem>

#include "meshing/surface/mesh.hpp"

namespace nbd {

/// Reads the triangles of a .obj, .ply, .stl, .off or .glb file (by extension, in either case) without
/// scaling; units are metres. The y axis of a .glb file, which is up there, becomes z. Groups and objects are
/// joined in file order, instances with their transforms. Faces keep the file's order; the triangles of a
/// polygon or strip take its place; lines and points are skipped. Vertices with exactly equal positions are
/// welded and numbered by first appearance in the file (.obj, .stl: in the faces). Coordinates are read in
/// double precision. The surface may be open, degenerate and so on: see check_surface(). Throws a one-line
/// std::runtime_error that starts with the path for a missing, empty or unreadable file, a directory, an
/// unknown extension, a truncated file if the format allows to detect it, a face index out of range, a
/// coordinate that no float32 can hold, or a file without faces.
TriMesh read_surface(const std::filesystem::path& path);

/// About how many faces a surface file (.obj .ply .stl .off .glb) holds, without reading it into memory: by
/// its header (.ply .off, binary .stl), a count of its face lines (.obj), else by its size; never more than a
/// file of its size can hold. 0 for a file that cannot be read; read_surface() says why.
std::uint64_t estimate_faces(const std::filesystem::path& path);

}  // namespace nbd
