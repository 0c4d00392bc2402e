#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "meshing/formats/tet_formats.hpp"

namespace nbd {

/// Cells as VTK's formats have them: cell c has the corners from offsets[c] to offsets[c + 1] - 1.
struct VtkCells {
    std::vector<std::int64_t> offsets;  // ascending, from 0 to the number of corners
    std::vector<std::int64_t> corners;  // nodes, counted from that of the piece
    std::vector<std::int64_t> types;    // one per cell
};

/// Adds the tetrahedra of the cells, whose corners count from `first_node` on; other_cells counts points,
/// lines and surface cells. Fails as FileCursor does for other volumes and for corners beyond content.nodes.
void add_cells(const VtkCells& cells, std::int64_t first_node, const FileCursor& in, TetFileContent& content);

}  // namespace nbd
