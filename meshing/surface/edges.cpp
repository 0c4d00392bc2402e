#include "meshing/surface/edges.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <numeric>
#include <stdexcept>
#include <utility>

namespace nbd {

EdgeTable edge_table(FacesRef F) {
    const std::size_t count = 3 * F.rows();
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
        table.edges.back().end = i + 1;
        table.halfedges[i] = h;
        table.edge_of[h] = table.edges.size() - 1;
    }
    return table;
}

DisjointSets::DisjointSets(int count) : parent_(count), count_(count) {
    std::iota(parent_.begin(), parent_.end(), 0);
}

void DisjointSets::join(int a, int b) {
    a = root(a), b = root(b);
    if (a != b) parent_[std::max(a, b)] = std::min(a, b), --count_;
}

int DisjointSets::root(int number) {
    while (parent_[number] != number) {
        int& parent = parent_[number];
        number = parent = parent_[parent];
    }
    return number;
}

Components make_orientations_agree(Faces& F, const EdgeTable& table) {
    const std::size_t face_count = F.rows();
    Components components{0, std::vector<int>(face_count, -1)};
    std::vector<char> turned(face_count, 0);
    const auto starts_low = [&](int h) { return F(h / 3, h % 3) < F(h / 3, (h % 3 + 1) % 3); };
    std::vector<int> stack;
    for (int seed = 0; seed < F.rows(); ++seed) {
        if (components.of_face[seed] >= 0) continue;
        components.of_face[seed] = components.count;
        stack.push_back(seed);
        while (!stack.empty()) {
            const int f = stack.back();
            stack.pop_back();
            for (int h = 3 * f; h < 3 * f + 3; ++h) {
                const int twin = table.twin(h), g = twin / 3;
                // Compares the faces as stored in F; F is changed only at the end.
                const bool agree = starts_low(h) != starts_low(twin);
                const char wanted = static_cast<char>(turned[f] != (agree ? 0 : 1));
                int& component = components.of_face[g];
                if (component < 0) {
                    component = components.count;
                    turned[g] = wanted;
                    stack.push_back(g);
                } else if (turned[g] != wanted) {
                    throw std::invalid_argument(
                        fmt::format("the surface is one-sided (like a Klein bottle): "
                                    "faces {} and {} cannot be oriented consistently",
                                    std::min(f, g), std::max(f, g)));
                }
            }
        }
        ++components.count;
    }
    for (int f = 0; f < F.rows(); ++f)
        if (turned[f]) std::swap(F(f, 1), F(f, 2));
    return components;
}

}  // namespace nbd
