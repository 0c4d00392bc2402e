#include "sim/factor/block_pattern.hpp"

#include <algorithm>
#include <cstddef>
#include <numeric>

namespace nbd {

RowLists items_by_row(std::span<const int> row_of, int rows) {
    RowLists lists{std::vector<int>(rows + 1, 0), std::vector<int>(row_of.size())};
    for (const int row : row_of) ++lists.offset[row + 1];
    std::partial_sum(lists.offset.begin(), lists.offset.end(), lists.offset.begin());
    std::vector<int> next(lists.offset.begin(), lists.offset.end() - 1);
    for (std::size_t item = 0; item < row_of.size(); ++item) lists.column[next[row_of[item]]++] = item;
    return lists;
}

BlockPattern::BlockPattern(int node_count, const ElementNodes& elements)
    : BlockPattern([&] {
          std::vector<std::vector<int>> rows(node_count);
          for (const auto& element : elements.rowwise())
              for (const int node : element)
                  rows[node].insert(rows[node].end(), element.begin(), element.end());
          return rows;
      }()) {}

BlockPattern::BlockPattern(std::vector<std::vector<int>> rows) {
    for (std::size_t i = 0; i < rows.size(); ++i) {
        std::vector<int>& row = rows[i];
        row.push_back(i);
        std::sort(row.begin(), row.end());
        row.erase(std::unique(row.begin(), row.end()), row.end());
        lists_.column.insert(lists_.column.end(), row.begin(), row.end());
        lists_.end_row();
    }
}

int BlockPattern::find(int i, int j) const noexcept {
    const auto row = neighbours(i);
    const auto it = std::lower_bound(row.begin(), row.end(), j);
    return it != row.end() && *it == j ? first_block(i) + (it - row.begin()) : -1;
}

SparseMatrix BlockPattern::zero_matrix() const {
    const Eigen::Index n = 3 * static_cast<Eigen::Index>(node_count());
    SparseMatrix A(n, n);
    A.resizeNonZeros(9 * static_cast<Eigen::Index>(block_count()));
    int* column = A.outerIndexPtr();
    int* row = A.innerIndexPtr();
    *column = 0;
    for (int i = 0; i < node_count(); ++i)
        for (int c = 0; c < 3; ++c) {
            for (int j : neighbours(i))
                for (int r = 0; r < 3; ++r) *row++ = 3 * j + r;
            column[1] = column[0] + column_height(i);
            ++column;
        }
    A.coeffs().setZero();
    return A;
}

}  // namespace nbd
