#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "sim/factor/cholesky.hpp"
#include "sim/multilevel/block_sparse.hpp"
#include "sim/multilevel/level_couplings.hpp"

namespace nbd {

/// The coarsest level of a coupled system, which is factorised. Rows of all bodies stand one below the other.
class CoarsestSolve {
 public:
    /// matrices: of the bodies. Throws std::runtime_error if the sum is not positive definite.
    void factorize(std::span<const BlockSparse<6, 6>* const> matrices, const LevelCouplings<6>& couplings,
                   std::span<const ActingCoupling> acting);

    /// x = A^-1 b, [6 rows].
    void solve(std::span<const float> b, std::span<float> x);

 private:
    void add(int row, int column, const Eigen::Matrix<double, 6, 6>& block);

    struct Row {
        std::vector<int> columns;
        std::vector<Eigen::Matrix<double, 6, 6>> blocks;
    };
    std::vector<Row> rows_;  // blocks of columns >= the row
    Cholesky cholesky_;
    Eigen::VectorXd x_;
};

}  // namespace nbd
