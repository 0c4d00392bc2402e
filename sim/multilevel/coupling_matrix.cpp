#include "sim/multilevel/coupling_matrix.hpp"

#include <algorithm>
#include <utility>

namespace nbd {
namespace {

std::size_t diagonal_at(const BlockSparse<6, 6>& blocks, int row) {
    const auto columns = blocks.columns_of(row);
    return std::ranges::lower_bound(columns, row) - columns.begin();
}

/// C without its diagonal blocks is bounded entry by entry, with t from the diagonal.
void set_damping(CouplingMatrix<6>& C) {
    using Column = Eigen::Matrix<double, 6, 1>;
    const int count = C.rows.size();
    std::vector<Column> roots;  // of the diagonal
    for (int i = 0; i < count; ++i)
        roots.push_back(C.blocks.block(i, diagonal_at(C.blocks, i)).diagonal().cwiseMax(0).cwiseSqrt());
    C.damping.resize(C.rows.size());
    parallel_for(
        count,
        [&](int i) {
            const Column& own = roots[i];
            Column bound = Column::Zero();
            const auto columns = C.blocks.columns_of(i);
            for (std::size_t k = 0; k < columns.size(); ++k) {
                if (columns[k] == i) continue;
                const Column& other = roots[columns[k]];
                for (int q = 0; q < 6; ++q)
                    if (other[q] > 0)
                        bound += (C.blocks.block(i, k).col(q).cwiseAbs().cwiseProduct(own) / other[q])
                                     .cwiseMin(own.cwiseAbs2());
            }
            CouplingMatrix<6>::Square& damping = C.damping[i];
            damping = C.blocks.block(i, diagonal_at(C.blocks, i));
            damping.diagonal() += CouplingMatrix<6>::damping_share * bound;
        },
        32);
}

}  // namespace

template <int B>
CouplingMatrix<6> coarsen(const CouplingMatrix<B>& C, const BlockSparse<B, 6>& prolongation,
                          std::vector<int> rows) {
    CouplingMatrix<6> coarser;
    coarser.rows = std::move(rows);
    coarser.blocks = product(transpose(prolongation), product(C.blocks, prolongation));
    set_damping(coarser);
    return coarser;
}

template CouplingMatrix<6> coarsen(const CouplingMatrix<3>&, const BlockSparse<3, 6>&, std::vector<int>);
template CouplingMatrix<6> coarsen(const CouplingMatrix<6>&, const BlockSparse<6, 6>&, std::vector<int>);

}  // namespace nbd
