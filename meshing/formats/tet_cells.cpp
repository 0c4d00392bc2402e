#include "meshing/formats/tet_cells.hpp"

#include <fmt/format.h>

#include <array>

namespace nbd {
namespace {

constexpr std::int64_t vtk_tetrahedron = 10;

/// Corner count of a point, line or surface cell type; 0 if any number is allowed.
std::int64_t corners_of(std::int64_t cell_type) {
    switch (cell_type) {
        case 1:
            return 1;
        case 3:
            return 2;
        case 5:
        case 21:
            return 3;
        case 8:
        case 9:
            return 4;
        case 22:
            return 6;
        case 23:
            return 8;
        default:
            return 0;
    }
}

bool is_volume(std::int64_t cell_type) {
    // Points, lines, polygons, and the quadratic edge, triangle and quad; all other types are volumes or
    // unusual.
    return !((cell_type >= 1 && cell_type <= 9) || (cell_type >= 21 && cell_type <= 23));
}

}  // namespace

void add_cells(const VtkCells& cells, std::int64_t first_node, const FileCursor& in,
               TetFileContent& content) {
    const std::int64_t nodes = static_cast<std::int64_t>(content.nodes.size()) - first_node;
    for (std::size_t c = 0; c < cells.types.size(); ++c) {
        const std::int64_t type = cells.types[c], corners = cells.offsets[c + 1] - cells.offsets[c];
        if (is_volume(type) && (type != vtk_tetrahedron || corners != 4))
            in.fail(fmt::format(
                "cell {} is a volume of type {} with {} corners; only 4-node tetrahedra are allowed", c, type,
                corners));
        if (const std::int64_t allowed = corners_of(type); allowed != 0 && corners != allowed)
            in.fail(fmt::format("cell {} of type {} has {} corners; allowed: {}", c, type, corners, allowed));
        if (type != vtk_tetrahedron) {
            ++content.other_cells;
            continue;
        }
        std::array<int, 4> tet{};
        for (std::size_t k = 0; k < 4; ++k) {
            const std::int64_t node = cells.corners[static_cast<std::size_t>(cells.offsets[c]) + k];
            if (node < 0 || node >= nodes)
                in.fail(fmt::format("cell {} refers to point {}; allowed: 0 to {}", c, node, nodes - 1));
            tet[k] = first_node + node;
        }
        content.tets.push_back(tet);
    }
}

}  // namespace nbd
