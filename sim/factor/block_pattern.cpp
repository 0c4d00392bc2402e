#include "sim/factor/block_pattern.hpp"

#include <algorithm>

#include "meshing/parallel/parallel_for.hpp"

namespace nbd {

BlockPattern::BlockPattern(int node_count, const Tets& tets)
    : BlockPattern([&] {
          std::vector<std::vector<int>> rows(node_count);
          for (Eigen::Index t = 0; t < tets.rows(); ++t)
              for (int a = 0; a < 4; ++a)
                  for (int b = 0; b < 4; ++b) rows[tets(t, a)].push_back(tets(t, b));
          return rows;
      }()) {}

BlockPattern::BlockPattern(std::vector<std::vector<int>> rows) : offset_{0} {
    for (std::size_t i = 0; i < rows.size(); ++i) {
        std::vector<int>& row = rows[i];
        row.push_back(i);
        std::sort(row.begin(), row.end());
        row.erase(std::unique(row.begin(), row.end()), row.end());
        neighbour_.insert(neighbour_.end(), row.begin(), row.end());
        offset_.push_back(neighbour_.size());
    }
}

int BlockPattern::find(int i, int j) const noexcept {
    const auto row = neighbours(i);
    const auto it = std::lower_bound(row.begin(), row.end(), j);
    return it != row.end() && *it == j ? offset_[i] + (it - row.begin()) : -1;
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
    std::fill(A.valuePtr(), A.valuePtr() + A.nonZeros(), 0.0);
    return A;
}

Eigen::Vector3d BlockPattern::multiply_row(const SparseMatrix& A, int i, const double* v) const noexcept {
    // A is symmetric, so the three columns of node i are its rows. All three use the same entries of v,
    // gathered once.
    constexpr int most = 64;  // nodes per pass
    double near[3 * most];
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    const auto row = neighbours(i);
    const Eigen::Index height = column_height(i);
    const double* values = A.valuePtr() + value_index(i, 0);
    for (std::size_t begin = 0; begin < row.size(); begin += most) {
        const auto part = row.subspan(begin, std::min<std::size_t>(most, row.size() - begin));
        double* end = near;
        for (const int j : part) end = std::copy_n(v + 3 * j, 3, end);
        const Eigen::Map<const Eigen::VectorXd> gathered(near, end - near);
        for (int c = 0; c < 3; ++c)
            sum[c] +=
                gathered.dot(Eigen::Map<const Eigen::VectorXd>(values + c * height + 3 * begin, end - near));
    }
    return sum;
}

void BlockPattern::multiply(const SparseMatrix& A, const Eigen::Ref<const Eigen::VectorXd>& v,
                            Eigen::Ref<Eigen::VectorXd> out) const {
    parallel_for(node_count(), [&](int i) { out.segment<3>(3 * i) = multiply_row(A, i, v.data()); });
}

}  // namespace nbd
