#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "collision/geometry/geometry.hpp"

namespace nbd {

/// Positions of a surface that is embedded in a coarser mesh, x = W nodes, each vertex computed when it is
/// first asked for in a pose: whoever reads few of them pays for few.
class EmbeddedPositions {
 public:
    using Rows = Eigen::Map<const Vertices, 0, Eigen::OuterStride<>>;

    /// W by compressed rows: vertex v is the sum of weights[k] * nodes.row(columns[k]) over k from
    /// row_begin[v] to row_begin[v + 1]. Copied. Throws std::invalid_argument where these do not fit each
    /// other, or a column is not below `node_count`.
    EmbeddedPositions(std::span<const int> row_begin, std::span<const int> columns,
                      std::span<const float> weights, int node_count);

    int vertex_count() const noexcept { return static_cast<int>(row_begin_.size()) - 1; }

    /// Starts a pose. nodes: [node_count, 3], referred to until the next one. Costs nothing.
    void begin_pose(VerticesRef nodes) noexcept;

    /// Makes these vertices' rows fit the pose. Those that do already cost a look each.
    void compute(std::span<const int> vertices) noexcept {
        for (const int v : vertices)
            if (poses_[static_cast<std::size_t>(v)] != pose_) compute(v);
    }
    void compute_all() noexcept;

    /// [vertex_count, 3], with a stride of four floats; rows that were not computed hold older poses.
    Rows rows() const noexcept { return {x_.data(), vertex_count(), 3, Eigen::OuterStride<>(4)}; }

    /// Vertices computed in this pose.
    long computed() const noexcept { return computed_; }

 private:
    void compute(int vertex) noexcept;

    int node_count_;
    std::vector<int> row_begin_, columns_;
    std::vector<float> weights_;
    Eigen::Matrix<float, 4, Eigen::Dynamic> x_;  // [4, vertices], the fourth number 0
    std::vector<std::uint32_t> poses_;           // the pose each row belongs to
    std::uint32_t pose_ = 0;
    long computed_ = 0;
    const float* nodes_ = nullptr;
    Eigen::Index stride_ = 3;
};

}  // namespace nbd
