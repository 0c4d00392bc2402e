#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <span>
#include <type_traits>

#include "collision/geometry/geometry.hpp"

namespace nbd {

/// Weights W that carry the nodes of a coarser mesh to a surface: x = W nodes, rows sum to 1.
/// [surface vertices, nodes].
template <class Scalar>
using EmbeddingOf = Eigen::SparseMatrix<Scalar, Eigen::RowMajor>;
using Embedding = EmbeddingOf<double>;
using SurfaceEmbedding = EmbeddingOf<float>;

/// Position of one surface vertex: the sum of weights[k] * (node columns[k]) for k = 0 to count - 1, added in
/// this order. nodes: the nodes' coordinates, `stride` numbers apart.
template <class Scalar>
Eigen::Matrix<Scalar, 1, 3> embedded_position(int count, const int* columns, const Scalar* weights,
                                              const Scalar* nodes, Eigen::Index stride) noexcept {
    using Row = Eigen::Matrix<Scalar, 1, 3>;
    Row sum = Row::Zero();
    for (int k = 0; k < count; ++k) sum += weights[k] * Eigen::Map<const Row>(nodes + stride * columns[k]);
    return sum;
}

/// Likewise in float, without fused products on any machine: all parts of the library get the same bits.
Eigen::RowVector3f embedded_position(int count, const int* columns, const float* weights, const float* nodes,
                                     Eigen::Index stride) noexcept;

/// x = W nodes, row by row in the order of embedded_position(). nodes: [W.cols(), 3]. x: out, [W.rows(), 3],
/// allocated only when its size differs; must not overlap `nodes`.
template <class Scalar>
void apply_embedding(
    const EmbeddingOf<Scalar>& W,
    const std::type_identity_t<Eigen::Ref<const Eigen::Matrix<Scalar, Eigen::Dynamic, 3, Eigen::RowMajor>>>&
        nodes,
    Eigen::Matrix<Scalar, Eigen::Dynamic, 3, Eigen::RowMajor>& x) {
    x.resize(W.rows(), 3);
    const int *begin = W.outerIndexPtr(), *counts = W.innerNonZeroPtr();  // no counts: W is compressed
    for (Eigen::Index v = 0; v < W.rows(); ++v)
        x.row(v) =
            embedded_position(counts ? counts[v] : begin[v + 1] - begin[v], W.innerIndexPtr() + begin[v],
                              W.valuePtr() + begin[v], nodes.data(), nodes.outerStride());
}

// Compiled once, beside the function that it calls for every vertex.
extern template void apply_embedding<float>(const SurfaceEmbedding& W, const VerticesRef& nodes, Vertices& x);

/// Likewise, returned.
template <class Scalar>
Eigen::Matrix<Scalar, Eigen::Dynamic, 3, Eigen::RowMajor> embedded(
    const EmbeddingOf<Scalar>& W,
    const std::type_identity_t<Eigen::Ref<const Eigen::Matrix<Scalar, Eigen::Dynamic, 3, Eigen::RowMajor>>>&
        nodes) {
    Eigen::Matrix<Scalar, Eigen::Dynamic, 3, Eigen::RowMajor> x;
    apply_embedding(W, nodes, x);
    return x;
}

/// The embedding with these compressed rows: vertex v has the entries k in [row_begin[v], row_begin[v + 1]),
/// each with a column in [0, node_count) and a weight. Throws std::invalid_argument if the arrays do not fit
/// each other, a column is out of range, or the columns of a row do not ascend.
SurfaceEmbedding embedding_of_rows(std::span<const int> row_begin, std::span<const int> columns,
                                   std::span<const float> weights, int node_count);

}  // namespace nbd
