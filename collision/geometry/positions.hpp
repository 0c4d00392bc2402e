#pragma once

#include <span>
#include <utility>

#include "collision/base/prefetch.hpp"
#include "collision/geometry/embedded_positions.hpp"
#include "collision/geometry/geometry.hpp"
#include "collision/geometry/vertex_view.hpp"

namespace nbd {

/// A view of all positions of a pose, stored or computed on demand. Call require() for vertices before
/// reading them.
class Positions {
 public:
    using Rows = VertexView::Rows;

    Positions() = default;
    Positions(const VertexView& x) noexcept
        : x_(x.data()), rows_(x.count()), stride_(x.stride()), last_(x.count() - 1) {}
    template <VertexRows X>
    Positions(X&& x) : Positions(VertexView(std::forward<X>(x))) {}
    explicit Positions(EmbeddedPositions& source) noexcept
        : x_(source.rows().data()),
          rows_(source.vertex_count()),
          stride_(source.rows().outerStride()),
          last_(-1),  // every row has four numbers
          source_(&source) {}

    void require(std::span<const int> vertices) const noexcept {
        if (source_) source_->compute(vertices);
    }

    void require_all() const noexcept {
        if (source_) source_->compute_all();
    }

    /// Prefetches the positions of these vertices; no effect if positions are computed on demand.
    void prefetch(std::span<const int> vertices) const noexcept {
        if (source_) return;
        for (const int v : vertices) prefetch_line(data(v));
    }

    /// Vertex `v` as four floats, to fill a vector register: x, y, z. Lane 3 is unspecified and may not be
    /// finite.
    Eigen::Array4f operator[](int v) const noexcept {
        const float* p = data(v);
        if (v == last_) return {p[0], p[1], p[2], 0};  // the array may end here
        return Eigen::Map<const Eigen::Array4f>(p);
    }
    /// Pointer to the same four floats; copies them to `spare` if the array may end after the first three.
    const float* four(int v, Eigen::Array4f& spare) const noexcept {
        if (v != last_) return data(v);
        spare = (*this)[v];
        return spare.data();
    }
    Eigen::Map<const Eigen::Vector3f> point(int v) const noexcept {
        return Eigen::Map<const Eigen::Vector3f>(data(v));
    }
    const float* data(int v) const noexcept { return x_ + stride_ * v; }
    Rows rows() const noexcept { return {x_, rows_, 3, Eigen::OuterStride<>(stride_)}; }
    VertexView view() const { return {x_, rows_, stride_}; }
    bool are_on_demand() const noexcept { return source_ != nullptr; }

 private:
    const float* x_ = nullptr;
    Eigen::Index rows_ = 0, stride_ = 3, last_ = -1;
    EmbeddedPositions* source_ = nullptr;
};

}  // namespace nbd
