#include "apps/python/bindings/arrays.hpp"

#include <fmt/format.h>
#include <pybind11/stl/filesystem.h>

#include <algorithm>
#include <cctype>
#include <limits>
#include <stdexcept>
#include <string>

namespace nbd::python {
namespace {

std::string describe(const py::array& array) {
    return fmt::format("{} of shape {}", std::string(py::str(array.dtype())),
                       std::string(py::str(array.attr("shape"))));
}

template <class Scalar>
constexpr const char* number_name() {
    return std::is_same_v<Scalar, std::int32_t> ? "whole numbers" : "numbers";
}

/// Whether numpy may convert the array's numbers to Scalar.
template <class Scalar>
bool converts(const py::array& array) {
    const char kind = array.dtype().kind();
    const bool is_whole = kind == 'i' || kind == 'u';
    return std::is_same_v<Scalar, std::int32_t> ? is_whole : is_whole || kind == 'f';
}

/// As whole numbers in the range of int32. Throws std::invalid_argument for others.
py::array_t<std::int32_t, py::array::c_style> narrowed(const py::array& array, const char* name) {
    const auto wide = py::array_t<std::int64_t, py::array::c_style | py::array::forcecast>::ensure(array);
    const std::span<const std::int64_t> all(wide.data(), wide.size());
    for (const std::int64_t number : all)
        if (number < std::numeric_limits<std::int32_t>::min() ||
            number > std::numeric_limits<std::int32_t>::max())
            throw std::invalid_argument(fmt::format("{}: {} is too large; allowed: int32", name, number));
    return py::array_t<std::int32_t, py::array::c_style | py::array::forcecast>::ensure(array);
}

template <class Scalar>
py::array_t<Scalar, py::array::c_style> converted(const py::array& array, const char* name) {
    if constexpr (std::is_same_v<Scalar, std::int32_t>) {
        if (!py::isinstance<py::array_t<std::int32_t>>(array)) return narrowed(array, name);
    }
    return py::array_t<Scalar, py::array::c_style | py::array::forcecast>::ensure(array);
}

py::array array_from(py::handle value, const char* name, const char* wanted) {
    py::array array = py::array::ensure(value);
    if (!array) {
        PyErr_Clear();
        throw std::invalid_argument(
            fmt::format("{}: is {}; allowed: {}", name, std::string(py::str(py::type::of(value))), wanted));
    }
    return array;
}

/// An array of one dimension.
template <class Scalar>
py::array_t<Scalar, py::array::c_style> flat(py::handle value, const char* name) {
    const std::string wanted = fmt::format("an array of {}, one dimension", number_name<Scalar>());
    const py::array array = array_from(value, name, wanted.c_str());
    if (array.ndim() != 1 || (array.size() > 0 && !converts<Scalar>(array)))
        throw std::invalid_argument(fmt::format("{}: is {}; allowed: {}", name, describe(array), wanted));
    return converted<Scalar>(array, name);
}

}  // namespace

py::array_t<int> pair_array(std::span<const FacePair> pairs) {
    static_assert(sizeof(FacePair) == 2 * sizeof(int));
    py::array_t<int> array({static_cast<py::ssize_t>(pairs.size()), py::ssize_t{2}});
    std::copy_n(reinterpret_cast<const int*>(pairs.data()), 2 * pairs.size(), array.mutable_data());
    return array;
}

template <class Scalar>
Rows<Scalar>::Rows(py::handle value, const char* name, int columns) {
    const std::string wanted = fmt::format("an array of {}, [n, {}]", number_name<Scalar>(),
                                           columns > 0 ? fmt::to_string(columns) : "m");
    const py::array array = array_from(value, name, wanted.c_str());
    const bool is_empty_list = array.ndim() == 1 && array.size() == 0 && columns > 0;
    if (is_empty_list) {
        array_ = py::array_t<Scalar, py::array::c_style>(std::vector<py::ssize_t>{0, columns});
        return;
    }
    if (array.ndim() != 2 || (columns > 0 && array.shape(1) != columns) ||
        (array.size() > 0 && !converts<Scalar>(array)))
        throw std::invalid_argument(fmt::format("{}: is {}; allowed: {}", name, describe(array), wanted));
    array_ = converted<Scalar>(array, name);
}

template <class Scalar>
void Rows<Scalar>::expect(Eigen::Index rows, const char* name, const char* each) const {
    if (count() != rows)
        throw std::invalid_argument(
            fmt::format("{}: has {} rows; allowed: {}, one for each {}", name, count(), rows, each));
}

template class Rows<double>;
template class Rows<float>;
template class Rows<std::int32_t>;

ReferredVertices::ReferredVertices(py::handle value, const char* name, Eigen::Index rows, bool check)
    : rows_(rows) {
    if (!py::isinstance<py::array>(value))
        throw std::invalid_argument(fmt::format("{}: is {}; allowed: a numpy array, which is referred to",
                                                name, std::string(py::str(py::type::of(value)))));
    const auto array = py::reinterpret_borrow<py::array>(value);
    const bool fits = py::isinstance<py::array_t<float, py::array::c_style>>(array) && array.ndim() == 2 &&
                      array.shape(0) == rows && array.shape(1) == 3;
    if (!fits)
        throw std::invalid_argument(
            fmt::format("{}: is {}{}; allowed: float32 of shape ({}, 3), row by row in memory, "
                        "since the array is referred to; see numpy.ascontiguousarray(x, numpy.float32)",
                        name, describe(array), array.flags() & py::array::c_style ? "" : ", strided", rows));
    array_ = array;
    data_ = static_cast<const float*>(array.data());
    if (check && !vertices().rows().allFinite())
        throw std::invalid_argument(fmt::format("{}: has a number that is not finite", name));
}

std::vector<int> index_list(py::handle value, const char* name) {
    const auto array = flat<std::int32_t>(value, name);
    return {array.data(), array.data() + array.size()};
}

std::vector<double> number_list(py::handle value, const char* name) {
    const auto array = flat<double>(value, name);
    return {array.data(), array.data() + array.size()};
}

void check_line(const std::string& text, const char* name) {
    if (std::ranges::any_of(text, [](unsigned char c) { return std::iscntrl(c); }))
        throw std::invalid_argument(
            fmt::format("{}: has a control character; allowed: one line of text", name));
}

std::filesystem::path path_from(py::handle value, const char* name) {
    try {
        return value.cast<std::filesystem::path>();
    } catch (const py::cast_error&) {
        throw std::invalid_argument(
            fmt::format("{}: is {}; allowed: a path", name, std::string(py::str(py::type::of(value)))));
    }
}

Embedding embedding_from(py::handle given, const char* name, Eigen::Index node_count) {
    // Other sparse matrices than those in compressed rows have the same attributes with another meaning.
    py::object value = py::reinterpret_borrow<py::object>(given);
    if (py::hasattr(value, "tocsr")) value = value.attr("tocsr")();
    py::object parts[3];
    constexpr const char* names[] = {"data", "indices", "indptr"};
    for (int i = 0; i < 3; ++i) {
        const bool is_tuple = py::isinstance<py::tuple>(value) && py::len(value) == 3;
        if (!is_tuple && !py::hasattr(value, names[i]))
            throw std::invalid_argument(
                fmt::format("{}: is {}; allowed: (data, indices, indptr) or scipy.sparse.csr_matrix", name,
                            std::string(py::str(py::type::of(value)))));
        parts[i] = is_tuple ? py::object(value[py::int_(i)]) : py::object(value.attr(names[i]));
    }
    const auto data = flat<double>(parts[0], name);
    const auto columns = flat<std::int32_t>(parts[1], name), ends = flat<std::int32_t>(parts[2], name);
    const auto rows = ends.size() - 1;
    bool fits = rows >= 1 && data.size() == columns.size() && ends.at(0) == 0 && ends.at(rows) == data.size();
    for (py::ssize_t row = 0; fits && row < rows; ++row) fits = ends.at(row) <= ends.at(row + 1);
    for (py::ssize_t k = 0; fits && k < data.size(); ++k)
        fits = columns.at(k) >= 0 && columns.at(k) < node_count;
    if (!fits)
        throw std::invalid_argument(
            fmt::format("{}: is no matrix in compressed rows over {} nodes; "
                        "allowed: as many data as indices, and row ends that grow from 0 to their number",
                        name, node_count));
    std::vector<Eigen::Triplet<double>> triplets;
    for (py::ssize_t row = 0; row < rows; ++row)
        for (int k = ends.at(row); k < ends.at(row + 1); ++k)
            triplets.emplace_back(row, columns.at(k), data.at(k));
    Embedding W(rows, node_count);
    W.setFromTriplets(triplets.begin(), triplets.end());
    return W;
}

}  // namespace nbd::python
