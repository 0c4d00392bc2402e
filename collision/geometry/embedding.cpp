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

template <>
void apply_embedding<float>(const SurfaceEmbedding& W, const VerticesRef& nodes, Vertices& x) {
    x.resize(W.rows(), 3);
    const int *begin = W.outerIndexPtr(), *counts = W.innerNonZeroPtr();  // no counts: W is compressed
    for (Eigen::Index v = 0; v < W.rows(); ++v)
        x.row(v) =
            embedded_position(counts ? counts[v] : begin[v + 1] - begin[v], W.innerIndexPtr() + begin[v],
                              W.valuePtr() + begin[v], nodes.data(), nodes.outerStride());
}

}  // namespace nbd
