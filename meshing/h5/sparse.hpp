#pragma once

#include <Eigen/SparseCore>
#include <string>
#include <vector>

#include "meshing/h5/reader.hpp"
#include "meshing/h5/writer.hpp"

namespace nbd::h5 {

/// A sparse matrix in file layout: row i has entries rows[i] .. rows[i + 1] - 1 of cols and values, columns
/// ascending.
template <class T>
struct SparseRows {
    std::vector<int> rows, cols;
    std::vector<T> values;

    explicit SparseRows(Eigen::SparseMatrix<T, Eigen::RowMajor> W) {
        W.makeCompressed();
        rows.assign(W.outerIndexPtr(), W.outerIndexPtr() + W.rows() + 1);
        cols.assign(W.innerIndexPtr(), W.innerIndexPtr() + W.nonZeros());
        values.assign(W.valuePtr(), W.valuePtr() + W.nonZeros());
    }
};

/// Writes NAME/rows, NAME/cols and NAME/values.
template <class T>
void write_sparse(Writer& file, const std::string& name, const Eigen::SparseMatrix<T, Eigen::RowMajor>& W) {
    const SparseRows<T> s(W);
    file.write(name + "/rows", s.rows, Packing::deflate);
    file.write(name + "/cols", s.cols, Packing::deflate);
    file.write(name + "/values", s.values, Packing::deflate);
}

/// Reads a matrix written by write_sparse(). Throws std::runtime_error if the arrays do not form a matrix of
/// this shape.
template <class T>
Eigen::SparseMatrix<T, Eigen::RowMajor> read_sparse(const Reader& file, const std::string& name,
                                                    std::size_t rows, std::size_t cols) {
    const auto offsets = file.read<int>(name + "/rows", {rows + 1});
    const auto columns = file.read<int>(name + "/cols", {any});
    const auto values = file.read<T>(name + "/values", {columns.size()});
    if (offsets.front() != 0 || offsets.back() != std::ssize(columns))
        file.refuse(
            name + "/rows spans " + std::to_string(offsets.front()) + " to " + std::to_string(offsets.back()),
            "0 to " + std::to_string(columns.size()) + ", the number of weights");
    for (std::size_t i = 0; i < rows; ++i) {
        if (offsets[i] > offsets[i + 1])
            file.refuse(name + "/rows falls after row " + std::to_string(i), "ascending offsets");
        for (int k = offsets[i]; k < offsets[i + 1]; ++k) {
            const int col = columns[k];
            const int least = k > offsets[i] ? columns[k - 1] + 1 : 0;
            if (col < least || col >= static_cast<int>(cols))
                file.refuse(
                    name + "/cols: row " + std::to_string(i) + " refers to column " + std::to_string(col),
                    std::to_string(least) + " to " + std::to_string(cols - 1) + ", ascending");
        }
    }
    return Eigen::Map<const Eigen::SparseMatrix<T, Eigen::RowMajor>>(
        rows, cols, columns.size(), offsets.data(), columns.data(), values.data());
}

}  // namespace nbd::h5
