#include "collision/bounds/affine/leaf_positions.hpp"

#include <cstring>

namespace nbd {
namespace {

/// One register: a vector of the compiler.
using Four = float __attribute__((vector_size(16)));

Four four_floats(const float* p) noexcept {
    Four result;
    std::memcpy(&result, p, sizeof result);
    return result;
}
Four three_floats(const float* p) noexcept { return Four{p[0], p[1], p[2], 0}; }

/// count: 0 if it is not known at compile time.
template <int fixed_count, class Load>
void sums(const float* points, const int* places, const float* weights, const std::uint16_t* nodes,
          int counted, int vertices, float* x, const Load& load) noexcept {
    const int count = fixed_count == 0 ? counted : fixed_count;
    for (int v = 0; v < vertices; ++v) {
        Four sum{};
        for (int k = 0; k < count; ++k)
            sum += weights[v * count + k] * load(points + places[nodes[v * count + k]]);
        std::memcpy(x + 4 * v, &sum, sizeof sum);
    }
}

}  // namespace

void leaf_positions(const float* points, const int* places, const float* weights, const std::uint16_t* nodes,
                    int count, int vertices, bool at_end, float* x) noexcept {
    if (at_end) return sums<0>(points, places, weights, nodes, count, vertices, x, three_floats);
    if (count == 1) return sums<1>(points, places, weights, nodes, count, vertices, x, four_floats);
    if (count == 3) return sums<3>(points, places, weights, nodes, count, vertices, x, four_floats);
    if (count == 4) return sums<4>(points, places, weights, nodes, count, vertices, x, four_floats);
    sums<0>(points, places, weights, nodes, count, vertices, x, four_floats);
}

}  // namespace nbd
