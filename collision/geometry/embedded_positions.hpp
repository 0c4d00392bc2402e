#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "collision/geometry/vertex_view.hpp"

namespace nbd {

/// Positions of a surface that is embedded in a coarser mesh, x = W nodes. Each vertex is computed when a
/// pose first needs it, so reading few vertices costs little.
class EmbeddedPositions {
 public:
    using Rows = VertexView::Rows;

    /// W in compressed rows: vertex v is the sum of weights[k] * nodes.row(columns[k]) over k in
    /// [row_begin[v], row_begin[v + 1]). The arrays are copied. Throws std::invalid_argument if they do not
    /// fit each other or a column is not in [0, node_count).
    EmbeddedPositions(std::span<const int> row_begin, std::span<const int> columns,
                      std::span<const float> weights, int node_count);

    int vertex_count() const noexcept { return static_cast<int>(row_begin_.size()) - 1; }

    /// Starts a pose; computes nothing yet. nodes: [node_count, 3], must stay valid until the next pose.
    /// Throws std::invalid_argument on another number of nodes, and the last pose then stays.
    void begin_pose(VertexView nodes);

    /// Brings the rows of these vertices up to date with the pose. A row that is up to date costs one check.
    void compute(std::span<const int> vertices) noexcept {
        for (const int v : vertices)
            if (poses_[v] != pose_) compute(v);
    }
    void compute_all() noexcept;

    /// The nodes of this pose, with their own stride.
    Rows nodes() const noexcept { return nodes_.rows(); }

    /// [vertex_count, 3], with a stride of four floats. Rows not computed in this pose hold older positions.
    Rows rows() const noexcept { return {x_.data(), vertex_count(), 3, Eigen::OuterStride<>(4)}; }

    /// Number of vertices computed in this pose.
    long computed() const noexcept { return computed_; }

 private:
    void compute(int vertex) noexcept;

    int node_count_;
    std::vector<int> row_begin_, columns_;
    std::vector<float> weights_;
    Eigen::Matrix<float, 4, Eigen::Dynamic> x_;  // [4, vertices]; the fourth number is 0
    std::vector<std::uint32_t> poses_;           // [vertices] pose in which each row was computed
    std::uint32_t pose_ = 0;
    long computed_ = 0;
    VertexView nodes_;
};

}  // namespace nbd
