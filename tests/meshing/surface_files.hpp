#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "meshing/surface/mesh.hpp"

/// The same surface as the bytes of each file format (texts with so many digits), written independently of
/// the library's own writers.
namespace nbd::test {

std::string obj_file(const TriMesh& mesh, int digits = 9);

std::string off_file(const TriMesh& mesh, int digits = 9);

std::string ascii_ply_file(const TriMesh& mesh, int digits = 9);

std::string binary_ply_file(const TriMesh& mesh, bool big_endian);

std::string ascii_stl_file(const TriMesh& mesh, int digits = 9);

std::string binary_stl_file(const TriMesh& mesh);

/// A .glb file of this JSON text and these data.
std::string glb_of(std::string json, const std::string& data);

/// `node`: further entries of the glTF node, such as "translation": [1, 2, 3].
std::string glb_file(const TriMesh& mesh, const std::string& node = "");

/// What read_surface() says of a file; empty if it reads it.
std::string reading_error(const std::filesystem::path& path);

/// Contents of a file, and what read_surface() says of it, in part.
using Refusals = std::vector<std::pair<std::string, std::string>>;

/// Expects all of these of a file of this name.
void expect_refused(const std::string& name, const Refusals& cases);

/// Positions of all corners in face order, independent of the numbering of the vertices.
Nodes corner_positions(const TriMesh& mesh);

}  // namespace nbd::test
