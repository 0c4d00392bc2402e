#pragma once

#include <filesystem>
#include <vector>

#include "meshing/surface/face_groups.hpp"

namespace nbd {

/// Reads the triangles of a .obj, .ply, .stl, .off or .glb file (by extension, in either case) without
/// scaling; units are metres. The y axis of a .glb file, which is up there, becomes z. Groups and objects are
/// joined in file order, instances with their transforms. Faces keep the file's order; the triangles of a
/// polygon or strip take its place; lines and points are skipped. Vertices with exactly equal positions are
/// welded and numbered by first appearance in the file (.obj, .stl: in the faces). Coordinates are read in
/// double precision. The surface may be open, degenerate and so on: see check_surface(). Throws a one-line
/// std::runtime_error that starts with the path for a missing, empty or unreadable file, a directory, an
/// unknown extension, a truncated file if the format allows to detect it, a face index out of range, a
/// coordinate that no float32 can hold, or a file without faces. groups: out, the groups of faces that an
/// .obj file names by `g`, `o` and `usemtl`, except those of all faces, in its order; null: not wanted.
TriMesh read_surface(const std::filesystem::path& path, std::vector<FaceGroup>* groups = nullptr);

}  // namespace nbd
