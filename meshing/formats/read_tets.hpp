#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "meshing/surface/mesh.hpp"

namespace nbd {

/// Reads tetrahedra made elsewhere: gmsh .msh (2.x and 4.1, text or binary), Medit .mesh (text), legacy VTK
/// .vtk (text or binary). The result is ready for use: finite, every tetrahedron positive (negative ones are
/// turned), at most two tetrahedra on a face, no node without a tetrahedron (such are dropped, the rest keep
/// their order). Points, lines and surface cells in the file are left out; other volume cells are an error.
/// notes: if given, receives one line for each thing that was turned, dropped or left out.
/// Throws std::runtime_error in one line (path, place, reason) on anything else, truncation included.
TetMesh read_tets(const std::filesystem::path& path, std::vector<std::string>* notes = nullptr);

}  // namespace nbd
