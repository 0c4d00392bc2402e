#pragma once

#include <concepts>
#include <span>
#include <stdexcept>
#include <type_traits>
#include <utility>

#include "collision/base/message.hpp"
#include "collision/base/prefetch.hpp"
#include "collision/geometry/geometry.hpp"

namespace nbd {

template <class X>
struct IsVertexMap : std::false_type {};
template <class Matrix, int options, class Stride>
struct IsVertexMap<Eigen::Map<Matrix, options, Stride>> : std::true_type {};
template <class Matrix, int options, class Stride>
struct IsVertexMap<Eigen::Ref<Matrix, options, Stride>> : std::negation<std::is_const<Matrix>> {};

/// What a VertexView can refer to without a copy: three float columns, row after row, that live longer than
/// the expression. This is a matrix with a name, an Eigen::Map, or an Eigen::Ref through which one may write.
/// An Eigen::Ref to constant numbers does not qualify, since it may hold a copy of its own.
template <class X>
concept VertexRows = requires {
    typename std::remove_cvref_t<X>::Scalar;
}
&&std::same_as<typename std::remove_cvref_t<X>::Scalar, float>&& std::remove_cvref_t<X>::ColsAtCompileTime ==
        3 &&
    bool{std::remove_cvref_t<X>::IsRowMajor} && std::remove_cvref_t<X>::InnerStrideAtCompileTime == 1 &&
    (IsVertexMap<std::remove_cvref_t<X>>::value ||
     (std::is_lvalue_reference_v<X> &&
      std::derived_from<std::remove_cvref_t<X>, Eigen::PlainObjectBase<std::remove_cvref_t<X>>>));

/// Positions of vertices that belong to the caller, [count, 3]: they are referred to, never copied, so
/// whoever keeps a view needs the array to stay where it is. Temporaries and what would have to be converted
/// (columns that follow each other, other numbers) do not compile.
class VertexView {
 public:
    using Rows = Eigen::Map<const Vertices, 0, Eigen::OuterStride<>>;

    VertexView() = default;
    /// x: `count` rows of three numbers, `stride` numbers from one row to the next. Throws
    /// std::invalid_argument unless count >= 0, stride >= 3, and x is an array if count > 0.
    VertexView(const float* x, Eigen::Index count, Eigen::Index stride = 3)
        : x_(x), count_(count), stride_(stride) {
        if (count < 0 || stride < 3 || (count > 0 && x == nullptr))
            throw std::invalid_argument(message("positions: ", x ? "an array" : "no array", " of ", count,
                                                " rows, ", stride,
                                                " numbers apart; allowed: an array, or no rows, at least 3 "
                                                "numbers apart"));
    }
    template <VertexRows X>
    VertexView(X&& x) : VertexView(x.data(), x.rows(), x.rows() > 1 ? x.outerStride() : 3) {}

    /// The rows that a function was given by reference, for no longer than that reference: it may own a copy.
    static VertexView as_long_as(const VerticesRef& x) { return {x.data(), x.rows(), x.outerStride()}; }
    static VertexView as_long_as(VerticesRef&&) = delete;

    const float* data() const noexcept { return x_; }
    Eigen::Index count() const noexcept { return count_; }
    Eigen::Index stride() const noexcept { return stride_; }
    Rows rows() const noexcept { return {x_, count_, 3, Eigen::OuterStride<>(stride_)}; }

    /// The three numbers of vertex `v`.
    const float* data(int v) const noexcept { return x_ + stride_ * v; }
    Eigen::Map<const Eigen::Vector3f> point(int v) const noexcept {
        return Eigen::Map<const Eigen::Vector3f>(data(v));
    }
    /// Vertex `v` as four floats, to fill a vector register: x, y, z. Lane 3 is unspecified and may not be
    /// finite.
    Eigen::Array4f operator[](int v) const noexcept {
        const float* p = data(v);
        if (v == count_ - 1) return {p[0], p[1], p[2], 0};  // the array may end here
        return Eigen::Map<const Eigen::Array4f>(p);
    }
    /// Pointer to the same four floats; copies them to `spare` if the array may end after the first three.
    const float* four(int v, Eigen::Array4f& spare) const noexcept {
        if (v != count_ - 1) return data(v);
        spare = (*this)[v];
        return spare.data();
    }
    void prefetch(std::span<const int> vertices) const noexcept {
        for (const int v : vertices) prefetch_line(data(v));
    }

 private:
    const float* x_ = nullptr;
    Eigen::Index count_ = 0, stride_ = 3;
};

/// Throws std::invalid_argument, naming the first row, if a position of these vertices or nodes is not
/// finite.
inline void require_finite_rows(const char* what, const VertexView& x) {
    for (Eigen::Index i = 0; i < x.count(); ++i) {
        const auto row = x.rows().row(i);
        if (!row.allFinite())
            throw std::invalid_argument(message("position of ", what, " ", i, " is (", row.x(), ", ", row.y(),
                                                ", ", row.z(), "), allowed: finite numbers"));
    }
}

}  // namespace nbd
