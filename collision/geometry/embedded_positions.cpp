#include "collision/geometry/embedded_positions.hpp"

#include <algorithm>
#include <stdexcept>

#include "collision/base/message.hpp"
#include "collision/geometry/embedding.hpp"

namespace nbd {

EmbeddedPositions::EmbeddedPositions(std::span<const int> row_begin, std::span<const int> columns,
                                     std::span<const float> weights, int node_count)
    : node_count_(node_count),
      row_begin_(row_begin.begin(), row_begin.end()),
      columns_(columns.begin(), columns.end()),
      weights_(weights.begin(), weights.end()) {
    check_embedding_rows(row_begin, columns, weights, node_count);
    x_.setZero(4, vertex_count());
    poses_.assign(vertex_count(), 0);
}

void EmbeddedPositions::begin_pose(VertexView nodes) {
    if (nodes.count() != node_count_)
        throw std::invalid_argument(
            message("nodes: ", nodes.count(), " rows, but the surface hangs on ", node_count_));
    nodes_ = nodes;
    computed_ = 0;
    if (++pose_ == 0) {  // the pose counter wrapped around: mark all rows as stale
        std::ranges::fill(poses_, 0);
        pose_ = 1;
    }
}

void EmbeddedPositions::compute(int vertex) noexcept {
    const std::size_t v = vertex;
    const int begin = row_begin_[v];
    x_.col(vertex).head<3>() = embedded_position(row_begin_[v + 1] - begin, columns_.data() + begin,
                                                 weights_.data() + begin, nodes_.data(), nodes_.stride())
                                   .transpose();
    poses_[v] = pose_;
    ++computed_;
}

void EmbeddedPositions::compute_all() noexcept {
    for (int v = 0; v < vertex_count(); ++v)
        if (poses_[v] != pose_) compute(v);
}

}  // namespace nbd
