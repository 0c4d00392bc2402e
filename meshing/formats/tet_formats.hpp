#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "meshing/formats/file_cursor.hpp"

namespace nbd {

/// Nodes that a file gives a name.
struct NodeSet {
    std::string name;
    std::vector<int> nodes;  // indices, in range
};

/// Content of a tetrahedron file; only its syntax and indices are checked.
struct TetFileContent {
    std::vector<std::array<double, 3>> nodes;
    std::vector<std::array<int, 4>> tets;  // indices into `nodes`, in range
    int other_cells = 0;                   // number of skipped points, lines and surface cells
    std::vector<int> group_of_tet;  // [tets] number of its group, 0: none; empty if the format has none
    std::map<int, std::string> group_names;  // where the file names them
    // Triangles with a group, by nodes, and the number of that; names of these groups, where there are any.
    std::vector<std::array<int, 3>> triangles{};
    std::vector<int> group_of_triangle{};
    std::map<int, std::string> triangle_group_names{};
    // Nodes with a name: of groups of the faces whose corners are all among them.
    std::vector<NodeSet> node_sets{};
    std::vector<std::string> notes{};  // a line for each kind of omission
};

/// Parsers of the formats. Each throws std::runtime_error as FileCursor does. A volume cell other than a
/// 4-node tetrahedron is an error, because skipping it would leave a hole.
/// gmsh .msh, versions 2.x and 4.1, text or binary.
TetFileContent read_gmsh(FileCursor& in);
/// Medit .mesh, text, ended by the keyword End or the end of the file.
TetFileContent read_medit(FileCursor& in);
/// VTK legacy .vtk, unstructured grid, versions 1 to 5.1, text or binary.
TetFileContent read_vtk(FileCursor& in);
/// VTK .vtu, unstructured grid: text, base 64 or raw appended data, plain or packed by zlib; all pieces.
TetFileContent read_vtu(FileCursor& in);
/// CalculiX or Abaqus .inp: nodes, elements, sets and surfaces; other keywords are skipped.
TetFileContent read_inp(FileCursor& in);

/// Cells as VTK's formats have them: cell c has the corners from offsets[c] to offsets[c + 1] - 1.
struct VtkCells {
    std::vector<std::int64_t> offsets;  // ascending, from 0 to the number of corners
    std::vector<std::int64_t> corners;  // nodes, counted from that of the piece
    std::vector<std::int64_t> types;    // one per cell
};

/// Adds the tetrahedra of the cells, whose corners count from `first_node` on; other_cells counts points,
/// lines and surface cells. Fails as FileCursor does for other volumes and for corners beyond content.nodes.
void add_cells(const VtkCells& cells, std::int64_t first_node, const FileCursor& in, TetFileContent& content);

/// Whether an array of whole numbers, one for each cell, tells the cells' groups by its name, as programs
/// call it: "group", "region", "material", "gmsh:physical", "medit:ref", "CellEntityIds" and their like.
bool names_groups(std::string_view array);

/// Gives the tetrahedra that add_cells() made of the cells, from `first_tet` on, and triangles their groups.
/// groups: one per cell.
void add_cell_groups(const VtkCells& cells, std::span<const std::int64_t> groups, std::int64_t first_node,
                     std::size_t first_tet, const FileCursor& in, TetFileContent& content);

}  // namespace nbd
