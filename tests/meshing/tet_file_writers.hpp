#pragma once

#include <string>

#include "meshing/surface/mesh.hpp"

namespace nbd {

/// The bytes of a tetrahedral mesh in each format that read_tets reads, following the specifications of the
/// formats. The gmsh and VTK writers add one triangle (nodes 0 1 2), which the reader must leave out.
std::string gmsh_2_text(const TetMesh& tets);
std::string gmsh_2_binary(const TetMesh& tets, bool big_endian);
std::string gmsh_4_text(const TetMesh& tets);
std::string gmsh_4_binary(const TetMesh& tets, bool big_endian);
std::string medit_text(const TetMesh& tets);
std::string vtk_text(const TetMesh& tets);
std::string vtk_binary(const TetMesh& tets);
std::string vtk_5_text(const TetMesh& tets);
std::string vtk_5_binary(const TetMesh& tets);

}  // namespace nbd
