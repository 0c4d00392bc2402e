#include "collision/geometry/embedding.hpp"

#include <algorithm>
#include <stdexcept>

#include "collision/base/message.hpp"

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

SurfaceEmbedding embedding_of_rows(std::span<const int> row_begin, std::span<const int> columns,
                                   std::span<const float> weights, int node_count) {
    if (row_begin.empty() || row_begin.front() != 0 || !std::ranges::is_sorted(row_begin) ||
        static_cast<std::size_t>(row_begin.back()) != columns.size() || columns.size() != weights.size())
        throw std::invalid_argument(
            message("the row offsets of an embedding must start at 0, ascend and end at its number of "
                    "columns and weights; there are ",
                    columns.size(), " columns and ", weights.size(), " weights"));
    for (const int column : columns)
        if (column < 0 || column >= node_count)
            throw std::invalid_argument(
                message("an embedding refers to node ", column, ", but the node count is ", node_count));
    const auto rows = static_cast<int>(row_begin.size()) - 1;
    for (int v = 0; v < rows; ++v) {
        const std::size_t begin = row_begin[v], end = row_begin[static_cast<std::size_t>(v) + 1];
        for (std::size_t k = begin + 1; k < end; ++k)
            if (columns[k - 1] >= columns[k])
                throw std::invalid_argument(message("row ", v, " of an embedding refers to node ", columns[k],
                                                    " after node ", columns[k - 1], "; allowed: ascending"));
    }
    return Eigen::Map<const SurfaceEmbedding>(rows, node_count, columns.size(), row_begin.data(),
                                              columns.data(), weights.data());
}

}  // namespace nbd
