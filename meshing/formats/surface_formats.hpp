#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

#include "meshing/surface/face_groups.hpp"

namespace nbd {

/// Unchecked content of a surface file: positions and polygons, face by face.
struct PolygonSoup {
    std::vector<std::array<double, 3>> X;
    std::vector<std::int64_t> corners;  // rows of X
    std::vector<std::size_t> face_end;  // for each face, one past its last corner
    std::vector<FaceGroup> groups{};    // of these faces
    std::size_t face_count() const noexcept { return face_end.size(); }
};

/// Triangles in the order of the faces. Skips faces with fewer than three corners. face_of: out, the face of
/// each triangle; null: not wanted. Throws std::runtime_error,
/// naming the face or vertex, for an index out of range, a coordinate that no float32 can hold, no faces at
/// all, or more than 2^31 - 1 vertices or face corners.
TriMesh triangulate(const PolygonSoup& soup, std::vector<int>* face_of = nullptr);

/// The triangles of the scene of a .glb file (glTF 2.0), node by node with their transforms, in metres and
/// with z up: glTF has y up, and (x, y, z) of it becomes (x, -z, y). Points and lines are skipped; skins and
/// morph targets are left at rest. Throws std::runtime_error for a damaged file, for data in other files, for
/// nodes nested more than 1000 deep, and for a required extension that changes surfaces, other than
/// KHR_mesh_quantization.
PolygonSoup read_glb(const std::filesystem::path& path);

/// The faces of a Wavefront OBJ file, in its order, and their vertices in the order in which the faces name
/// them. Reads `v` and `f`, and `g`, `o` and `usemtl`, whose names are groups of the faces that follow until
/// the next of the same kind. A vertex has 3 numbers, 4 with a weight that divides the others, or 6 with a
/// colour; a number may have a decimal comma. A corner names a vertex of the file, from 1 on, or from -1 back
/// from the last one before the face. A line that ends in a backslash goes on in the next one. Throws
/// std::runtime_error with the line's number, what it holds and what was allowed.
PolygonSoup read_obj(const std::filesystem::path& path);

/// Reads positions and faces of a text .off file; skips colours, normals and texture coordinates. Replaces
/// assimp's reader, which moves an out-of-range index into range and allocates any number of faces that a
/// damaged header claims. Throws std::runtime_error with the problem and its vertex or face.
PolygonSoup read_off(const std::filesystem::path& path);

/// Reads positions, faces and triangle strips of a .ply file, ascii or binary in either byte order; skips
/// other elements and properties. Replaces assimp's reader, which hangs or aborts on truncated files. Throws
/// std::runtime_error with the problem and its element.
PolygonSoup read_ply(const std::filesystem::path& path);

/// The facets of a STL file, text or binary, in its order; normals, names and colours are skipped. A text may
/// have its keywords in capitals and empty lines before "solid", and several solids are joined. A binary file
/// may have more bytes than its facets take; it may begin with "solid", too. Throws std::runtime_error with
/// path, place and reason for anything else.
PolygonSoup read_stl(const std::filesystem::path& path);

/// Cuts a polygon into corners.size() - 2 triangles on its own corners, with its orientation: by the
/// constrained Delaunay triangulation in the plane of its mean normal, in n log n steps. Where its sides
/// cross or corners coincide in that plane, there is no such cut; then a fan around the first corner, whose
/// triangles overlap there, keeps the surface closed. corners: three or more rows of X, which are finite.
std::vector<std::array<int, 3>> triangulate_polygon(NodesRef X, std::span<const int> corners);

}  // namespace nbd
