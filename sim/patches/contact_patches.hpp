#pragma once

#include <span>
#include <vector>

#include "collision/wide_tree/wide_tree.hpp"
#include "sim/patches/surface_normals.hpp"

namespace nbd {

/// A list for each of some things, one after the other in memory.
struct IndexLists {
    std::vector<int> begin{0};  // [lists + 1]
    std::vector<int> items;

    std::span<const int> operator[](int list) const noexcept {
        const std::size_t l = list;
        return std::span(items).subspan(begin[l], begin[l + 1] - begin[l]);
    }
    /// Ends the list that items were appended to.
    void end_list() { begin.push_back(items.size()); }
};

/// Compact parts of a surface: the leaves of a wide tree, at most sixteen faces each. A patch owns the
/// vertices and edges whose owner is among its faces, see SurfaceTopology, so each belongs to one patch.
struct ContactPatches {
    static constexpr int width = tree_width;
    static constexpr int max_edges = 3 * width;

    IndexLists faces, vertices, edges;  // of each patch; some patches have none
    std::vector<int> of_face;           // [m] patch of each face

    ContactPatches(const WideTree& tree, const SurfaceTopology& topology);
    int count() const noexcept { return static_cast<int>(faces.begin.size()) - 1; }
};

}  // namespace nbd
