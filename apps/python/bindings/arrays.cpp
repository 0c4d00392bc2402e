#include "apps/python/bindings/arrays.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <stdexcept>
#include <type_traits>

namespace nbd::python {
namespace {

std::string describe(const py::array& array) {
    return fmt::format("{} of shape {}", std::string(py::str(array.dtype())),
                       std::string(py::str(array.attr("shape"))));
}

std::string type_of(py::handle value) { return py::str(py::type::of(value)); }

/// Throws std::invalid_argument for whole numbers out of the range of int32.
void check_range(const py::array& array, const char* name) {
    if (py::isinstance<py::array_t<std::int32_t>>(array)) return;
    const auto wide = Numbers<std::int64_t>::ensure(array);
    for (const std::int64_t number : std::span(wide.data(), wide.size()))
        if (!std::in_range<std::int32_t>(number))
            throw std::invalid_argument(fmt::format("{}: {} is too large; allowed: int32", name, number));
}

}  // namespace

template <class Scalar>
Numbers<Scalar> numbers_from(py::handle value, const char* name, int columns) {
    constexpr bool takes_whole = std::is_same_v<Scalar, std::int32_t>;
    const auto refuse = [&](const std::string& what) {
        throw std::invalid_argument(fmt::format(
            "{}: is {}; allowed: an array of {}, {}", name, what, takes_whole ? "whole numbers" : "numbers",
            columns > 0 ? fmt::format("[n, {}]", columns) : "one dimension"));
    };
    const py::array array = py::array::ensure(value);
    if (!array) {
        PyErr_Clear();
        refuse(type_of(value));
    }
    const bool is_empty_list = array.ndim() == 1 && array.size() == 0;
    if (is_empty_list && columns > 0) return Numbers<Scalar>(std::vector<py::ssize_t>{0, columns});
    const char kind = array.dtype().kind();
    const bool is_whole = kind == 'i' || kind == 'u', converts = is_whole || (kind == 'f' && !takes_whole);
    const bool fits = columns > 0 ? array.ndim() == 2 && array.shape(1) == columns : array.ndim() == 1;
    if (!fits || (array.size() > 0 && !converts)) refuse(describe(array));
    if (takes_whole) check_range(array, name);
    return Numbers<Scalar>::ensure(array);
}

template Numbers<double> numbers_from<double>(py::handle, const char*, int);
template Numbers<float> numbers_from<float>(py::handle, const char*, int);
template Numbers<std::int32_t> numbers_from<std::int32_t>(py::handle, const char*, int);

void expect_nodes(Eigen::Index rows, Eigen::Index nodes) {
    if (rows != nodes)
        throw std::invalid_argument(
            fmt::format("x: has {} rows; allowed: {}, one for each node", rows, nodes));
}

ReferredVertices::ReferredVertices(py::handle value, const char* name, Eigen::Index rows, bool check)
    : rows_(rows) {
    if (!py::isinstance<py::array>(value))
        throw std::invalid_argument(
            fmt::format("{}: is {}; allowed: a numpy array, which is referred to", name, type_of(value)));
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

Eigen::Vector3d vector_from(py::handle value, const char* name) {
    const std::vector<double> three = list_from<double>(value, name);
    if (three.size() != 3) throw std::invalid_argument(fmt::format("{}: has not three numbers", name));
    return {three[0], three[1], three[2]};
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
        throw std::invalid_argument(fmt::format("{}: is {}; allowed: a path", name, type_of(value)));
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
                            type_of(value)));
        parts[i] = is_tuple ? py::object(value[py::int_(i)]) : py::object(value.attr(names[i]));
    }
    const auto data = numbers_from<double>(parts[0], name, 0);
    const auto columns = numbers_from<std::int32_t>(parts[1], name, 0),
               ends = numbers_from<std::int32_t>(parts[2], name, 0);
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
