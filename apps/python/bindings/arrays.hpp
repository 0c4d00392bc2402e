#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "collision/geometry/embedding.hpp"
#include "collision/geometry/geometry.hpp"
#include "collision/geometry/tet_mesh.hpp"
#include "collision/geometry/vertex_view.hpp"

// Arrays on their way between numpy and Eigen. Results own their memory or keep its owner alive; arguments
// are converted where numpy can do so without loss, and refused with one line where it cannot.
namespace nbd::python {

namespace py = pybind11;

/// Makes an array read-only.
inline void protect(py::array& array) {
    py::detail::array_proxy(array.ptr())->flags &= ~py::detail::npy_api::NPY_ARRAY_WRITEABLE_;
}

/// An array on the memory of a dense matrix. owner: what keeps that memory alive.
template <class Derived>
py::array view(const Eigen::PlainObjectBase<Derived>& matrix, py::handle owner, bool writable = false) {
    using Scalar = typename Derived::Scalar;
    constexpr py::ssize_t size = sizeof(Scalar);
    const py::ssize_t rows = matrix.rows(), columns = matrix.cols();
    std::vector<py::ssize_t> shape{rows}, strides{size};
    if constexpr (!Derived::IsVectorAtCompileTime) {
        shape = {rows, columns};
        strides = Derived::IsRowMajor ? std::vector<py::ssize_t>{size * columns, size}
                                      : std::vector<py::ssize_t>{size, size * rows};
    } else if constexpr (Derived::RowsAtCompileTime == 1) {
        shape = {columns};
    }
    py::array array(py::dtype::of<Scalar>(), shape, strides, matrix.data(), owner);
    if (!writable) protect(array);
    return array;
}

template <class Scalar>
py::array view(const std::vector<Scalar>& values, py::handle owner, bool writable = false) {
    py::array array(py::dtype::of<Scalar>(), {static_cast<py::ssize_t>(values.size())}, {sizeof(Scalar)},
                    values.data(), owner);
    if (!writable) protect(array);
    return array;
}

/// An array that took over the memory of a matrix or a vector of plain numbers; nothing is copied.
template <class Matrix>
py::array owned(Matrix matrix) {
    auto* kept = new Matrix(std::move(matrix));
    const py::capsule owner(kept, [](void* p) { delete static_cast<Matrix*>(p); });
    return view(*kept, owner, true);
}

/// A copy as int32 [pairs, 2].
py::array_t<int> pair_array(std::span<const FacePair> pairs);

/// An array argument as numbers of one type, row by row in memory: the caller's own memory if it is already
/// so, else a copy.
template <class Scalar>
class Rows {
 public:
    /// columns: that the array must have; 0: any. name: of the argument, for messages. Throws
    /// std::invalid_argument, one line, for anything but a two-dimensional array of numbers (real: of any
    /// type; int32: of integers in its range).
    Rows(py::handle value, const char* name, int columns);

    py::ssize_t count() const { return array_.shape(0); }
    /// Throws std::invalid_argument unless there are as many rows. each: what has a row, for the message.
    void expect(Eigen::Index rows, const char* name, const char* each) const;
    template <class Matrix>
    Eigen::Map<const Matrix> as() const {
        static_assert(std::is_same_v<typename Matrix::Scalar, Scalar> && Matrix::IsRowMajor);
        return {array_.data(), array_.shape(0), array_.shape(1)};
    }

 private:
    py::array_t<Scalar, py::array::c_style> array_;
};

using NodeRows = Rows<double>;
using VertexRows = Rows<float>;
using IndexRows = Rows<std::int32_t>;

/// An array argument that is referred to, never copied: float32, row by row in memory, [rows, 3], finite.
/// check: whether to look for numbers that are not finite. Throws std::invalid_argument, one line, for
/// anything else.
class ReferredVertices {
 public:
    ReferredVertices(py::handle value, const char* name, Eigen::Index rows, bool check);

    VertexView vertices() const { return {data_, rows_}; }
    const py::object& owner() const { return array_; }

 private:
    py::object array_;
    const float* data_ = nullptr;
    Eigen::Index rows_ = 0;
};

/// A list or array of whole numbers.
std::vector<int> index_list(py::handle value, const char* name);

/// A list or array of numbers.
std::vector<double> number_list(py::handle value, const char* name);

/// Throws std::invalid_argument for a text with a control character, such as a line break.
void check_line(const std::string& text, const char* name);

/// A path. Throws std::invalid_argument, one line, for anything but a text or an object with a path.
std::filesystem::path path_from(py::handle value, const char* name);

/// An embedding from (weights, columns, row ends), as numpy or scipy.sparse has it: a tuple (data, indices,
/// indptr) or an object with these attributes. node_count: the number of columns.
Embedding embedding_from(py::handle value, const char* name, Eigen::Index node_count);

/// (data, indices, indptr), on the memory of W, whose owner is kept alive.
template <class Scalar>
py::tuple embedding_views(const EmbeddingOf<Scalar>& W, py::handle owner) {
    const auto vector = [&](auto* values, Eigen::Index count) {
        using Number = std::remove_cv_t<std::remove_pointer_t<decltype(values)>>;
        py::array array(py::dtype::of<Number>(), {static_cast<py::ssize_t>(count)}, {sizeof(Number)}, values,
                        owner);
        protect(array);
        return array;
    };
    return py::make_tuple(vector(W.valuePtr(), W.nonZeros()), vector(W.innerIndexPtr(), W.nonZeros()),
                          vector(W.outerIndexPtr(), W.outerSize() + 1));
}

}  // namespace nbd::python
