#pragma once

#include <cstdint>

namespace nbd {

/// Positions of a leaf's vertices: the sum over k of weights[v * count + k] times the node at points +
/// places[nodes[v * count + k]], in this order and without fused products, like embedded_position(). at_end:
/// whether the array of points may end after one of these nodes. x: [vertices, 4], the fourth number is
/// unspecified.
void leaf_positions(const float* points, const int* places, const float* weights, const std::uint16_t* nodes,
                    int count, int vertices, bool at_end, float* x) noexcept;

}  // namespace nbd
