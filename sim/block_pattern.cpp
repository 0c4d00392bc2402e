#include "sim/block_pattern.hpp"

#include <algorithm>

#include "meshing/parallel/parallel_for.hpp"

namespace nbd {

BlockPattern::BlockPattern(int node_count, const Tets& tets) : offset_(node_count + 1, 0) {
    std::vector<std::vector<int>> rows(node_count);
    for (int i = 0; i < node_count; ++i) rows[i].push_back(i);
    for (Eigen::Index t = 0; t < tets.rows(); ++t)
        for (int a = 0; a < 4; ++a)
            for (int b = 0; b < 4; ++b)
                if (a != b) rows[tets(t, a)].push_back(tets(t, b));
    for (int i = 0; i < node_count; ++i) {
        std::sort(rows[i].begin(), rows[i].end());
        rows[i].erase(std::unique(rows[i].begin(), rows[i].end()), rows[i].end());
        offset_[i + 1] = offset_[i] + static_cast<int>(rows[i].size());
    }
    neighbour_.reserve(offset_.back());
    for (const auto& row : rows) neighbour_.insert(neighbour_.end(), row.begin(), row.end());
}

int BlockPattern::find(int i, int j) const noexcept {
    const auto row = neighbours(i);
    const auto it = std::lower_bound(row.begin(), row.end(), j);
    return it != row.end() && *it == j ? offset_[i] + static_cast<int>(it - row.begin()) : -1;
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
            column[1] = column[0] + static_cast<int>(column_height(i));
            ++column;
        }
    std::fill(A.valuePtr(), A.valuePtr() + A.nonZeros(), 0.0);
    return A;
}

void BlockPattern::multiply(const SparseMatrix& A, const Eigen::Ref<const Eigen::VectorXd>& v,
                            Eigen::Ref<Eigen::VectorXd> out) const {
    parallel_for(node_count(), [&](int i) {
        const auto row = neighbours(i);
        Eigen::Vector3d sum = Eigen::Vector3d::Zero();
        for (int k = 0; k < static_cast<int>(row.size()); ++k)
            sum += block(A, i, k).transpose() * v.segment<3>(3 * row[k]);
        out.segment<3>(3 * i) = sum;
    });
}

}  // namespace nbd
