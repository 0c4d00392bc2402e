#include "meshing/surface/edges.hpp"

#include <algorithm>
#include <cstdint>
#include <utility>

namespace nbd {

EdgeTable edge_table(FacesRef F) {
    const auto count = static_cast<std::size_t>(F.rows()) * 3;
    std::vector<std::pair<std::uint64_t, int>> keyed(count);  // both vertices in one number; half-edge
    for (int f = 0; f < F.rows(); ++f)
        for (int k = 0; k < 3; ++k) {
            const auto [a, b] = std::minmax({F(f, k), F(f, (k + 1) % 3)});
            const int h = 3 * f + k;
            keyed[h] = {static_cast<std::uint64_t>(a) << 32 | static_cast<std::uint32_t>(b), h};
        }
    std::ranges::sort(keyed);
    EdgeTable table;
    table.halfedges.resize(count);
    table.edge_of.resize(count);
    for (std::size_t i = 0; i < count; ++i) {
        const auto [key, h] = keyed[i];
        if (i == 0 || key != keyed[i - 1].first)
            table.edges.push_back({static_cast<int>(key >> 32), static_cast<int>(key & 0xffffffffu),
                                   static_cast<int>(i), static_cast<int>(i)});
        table.edges.back().end = static_cast<int>(i) + 1;
        table.halfedges[i] = h;
        table.edge_of[h] = static_cast<int>(table.edges.size()) - 1;
    }
    return table;
}

}  // namespace nbd
