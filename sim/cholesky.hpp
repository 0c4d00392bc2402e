#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>

#include "sim/block_pattern.hpp"

namespace nbd {

/// Sparse Cholesky factorisation (CHOLMOD, supernodal): analyse a pattern once, then factorise and solve for
/// many values. BLAS is held to one thread, so that the bits do not depend on the machine's cores. Not for
/// use from several threads at once; different objects are independent.
class Cholesky {
 public:
    Cholesky();
    ~Cholesky();
    Cholesky(Cholesky&&) noexcept;
    Cholesky& operator=(Cholesky&&) noexcept;

    /// Fill-reducing ordering and symbolic factorisation. A: symmetric 3 N x 3 N of full 3x3 blocks; only
    /// its pattern is read. Throws std::runtime_error when CHOLMOD fails (out of memory, too large).
    void analyze(const SparseMatrix& A);

    /// Numeric factorisation of a matrix of the analysed pattern; the lower triangle is read. Throws
    /// std::invalid_argument on another size or entry count, std::runtime_error when A is not positive
    /// definite (with the node whose pivot failed) or not finite. After a throw there is no factor.
    void factorize(const SparseMatrix& A);

    bool factorized() const noexcept;

    /// x = A^-1 b. Allocates on the first call only. x may be b. Throws std::logic_error without a factor,
    /// std::runtime_error when CHOLMOD fails.
    void solve(const Eigen::Ref<const Eigen::VectorXd>& b, Eigen::Ref<Eigen::VectorXd> x) const;

    std::int64_t factor_entries() const noexcept;  // stored numbers of the factor, explicit zeros included

 private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace nbd
