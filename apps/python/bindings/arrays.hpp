#pragma once

#include <pybind11/eigen.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "apps/python/bindings/typed.hpp"
#include "collision/geometry/embedding.hpp"
#include "collision/geometry/geometry.hpp"
#include "collision/geometry/vertex_view.hpp"

// Arrays on their way between numpy and Eigen. Results are those of pybind11/eigen.h: a matrix becomes a new
// array, and a reference to one a view that keeps its owner alive, which is read-only if it is constant.
// Arguments are converted where numpy can do so without loss, and refused with one line where it cannot.
namespace nbd::python {

template <class Scalar>
using Numbers = py::array_t<Scalar, py::array::c_style | py::array::forcecast>;

/// An array of numbers, row by row in memory: the caller's own memory if it is already so, else a copy.
/// columns: that it must have; 0: it has one dimension. Throws std::invalid_argument, one line, for anything
/// but such an array of numbers (real: of any type; int32: of integers in its range).
template <class Scalar>
Numbers<Scalar> numbers_from(py::handle value, const char* name, int columns);

/// An argument of this name whose rows are those of a matrix; see numbers_from().
template <class Matrix, Text name>
class Rows {
 public:
    explicit Rows(py::handle value)
        : numbers_(numbers_from<typename Matrix::Scalar>(value, name.text, Matrix::ColsAtCompileTime)) {
        static_assert(Matrix::IsRowMajor);
    }

    Eigen::Index count() const { return numbers_.shape(0); }
    Eigen::Map<const Matrix> operator*() const { return {numbers_.data(), count(), numbers_.shape(1)}; }

 private:
    Numbers<typename Matrix::Scalar> numbers_;
};

/// Throws std::invalid_argument unless node positions `x` have as many rows as there are nodes.
void expect_nodes(Eigen::Index rows, Eigen::Index nodes);

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

/// A list as an array of one dimension.
template <class Scalar>
Eigen::VectorX<Scalar> column(const std::vector<Scalar>& values) {
    return Eigen::Map<const Eigen::VectorX<Scalar>>(values.data(), std::ssize(values));
}

/// A list or array of numbers.
template <class Scalar>
std::vector<Scalar> list_from(py::handle value, const char* name) {
    const Numbers<Scalar> numbers = numbers_from<Scalar>(value, name, 0);
    return {numbers.data(), numbers.data() + numbers.size()};
}

/// A list or array of three numbers.
Eigen::Vector3d vector_from(py::handle value, const char* name);

/// Throws std::invalid_argument for a text with a control character, such as a line break.
void check_line(const std::string& text, const char* name);

/// A path. Throws std::invalid_argument, one line, for anything but a text or an object with a path.
std::filesystem::path path_from(py::handle value, const char* name);

/// An embedding from (weights, columns, row ends), as numpy or scipy.sparse has it: a tuple (data, indices,
/// indptr) or an object with these attributes. node_count: the number of columns.
Embedding embedding_from(py::handle value, const char* name, Eigen::Index node_count);

/// (data, indices, indptr), on the memory of W, whose owner is kept alive.
template <class Scalar>
Typed<"Weights"> embedding_views(const EmbeddingOf<Scalar>& W, py::handle owner) {
    const auto view = [&](const auto* values, Eigen::Index count) {
        using Vector = Eigen::VectorX<std::remove_cvref_t<decltype(*values)>>;
        return py::cast(Eigen::Map<const Vector>(values, count), py::return_value_policy::reference_internal,
                        owner);
    };
    return py::make_tuple(view(W.valuePtr(), W.nonZeros()), view(W.innerIndexPtr(), W.nonZeros()),
                          view(W.outerIndexPtr(), W.outerSize() + 1));
}

}  // namespace nbd::python

namespace pybind11::detail {

template <class Matrix, nbd::python::Text argument>
struct type_caster<nbd::python::Rows<Matrix, argument>> {
    using Argument = nbd::python::Rows<Matrix, argument>;
    static constexpr auto name = const_name("Array");
    template <class>
    using cast_op_type = const Argument&;

    bool load(handle value, bool) {
        rows.emplace(value);
        return true;
    }
    operator const Argument&() const { return *rows; }

    std::optional<Argument> rows;
};

/// Pairs of faces become a new array, int32 [pairs, 2].
struct FacePairsCaster {
    static constexpr auto name = const_name("Indices");

    static handle cast(std::span<const nbd::FacePair> pairs, return_value_policy, handle) {
        static_assert(sizeof(nbd::FacePair) == 2 * sizeof(int));
        array_t<int> array({std::ssize(pairs), ssize_t{2}});
        std::ranges::copy(pairs, reinterpret_cast<nbd::FacePair*>(array.mutable_data()));
        return array.release();
    }
};
template <>
struct type_caster<std::span<const nbd::FacePair>> : FacePairsCaster {};
template <>
struct type_caster<std::vector<nbd::FacePair>> : FacePairsCaster {};

}  // namespace pybind11::detail
