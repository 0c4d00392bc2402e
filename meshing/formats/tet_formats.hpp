#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "meshing/formats/file_cursor.hpp"

namespace nbd {

/// What a file of tetrahedra holds, before anything is checked but its grammar.
struct TetFileContent {
    std::vector<std::array<double, 3>> nodes;
    std::vector<std::array<int, 4>> tets;  // positions in `nodes`, in range
    int other_cells = 0;                   // points, lines and surface cells: read over
};

/// The grammars. Each throws std::runtime_error as FileCursor does; a volume cell that is no 4-node
/// tetrahedron is an error, since leaving it out would leave a hole.
/// gmsh .msh, versions 2.x and 4.1, text or binary.
TetFileContent read_gmsh(FileCursor& in);
/// Medit .mesh, text, ended by the keyword End.
TetFileContent read_medit(FileCursor& in);
/// VTK legacy .vtk, unstructured grid, versions 1 to 5.1, text or binary.
TetFileContent read_vtk(FileCursor& in);

}  // namespace nbd
