// This file is compiled without fused products.
#include "collision/geometry/embedding.hpp"

namespace nbd {

Eigen::RowVector3f embedded_position(int count, const int* columns, const float* weights, const float* nodes,
                                     Eigen::Index stride) noexcept {
    float x = 0, y = 0, z = 0;
    for (int k = 0; k < count; ++k) {
        const float* node = nodes + stride * columns[k];
        x += weights[k] * node[0];
        y += weights[k] * node[1];
        z += weights[k] * node[2];
    }
    return {x, y, z};
}

template void apply_embedding<float>(const SurfaceEmbedding& W, const VerticesRef& nodes, Vertices& x);

}  // namespace nbd
