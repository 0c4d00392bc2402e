#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <span>

#include "sim/factor/block_pattern.hpp"

namespace nbd {

/// A factor L of P A P^T as a supernodal factorisation keeps it. Supernode s owns the columns first_column[s]
/// .. first_column[s + 1] of L, all with the rows rows[first_row[s] .. first_row[s + 1]], of which the first
/// are its columns themselves; its values stand column by column from values[first_value[s]] on.
struct SupernodalFactor {
    std::span<const int> permutation;   // [n] unknown of A at each row of L
    std::span<const int> first_column;  // [supernodes + 1]
    std::span<const int> first_row;     // [supernodes + 1]
    std::span<const int> first_value;   // [supernodes + 1]
    std::span<const int> rows;          // ascending within a supernode
    std::span<const double> values;
};

/// How the nodes are ordered before they are eliminated.
enum class Ordering {
    thorough,  // the better of minimum degree and nested dissection: for factors that are used many times
    quick,     // minimum degree
};

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
    void analyze(const SparseMatrix& A, Ordering ordering = Ordering::thorough);

    /// Numeric factorisation of a matrix of the analysed pattern; the lower triangle is read. Throws
    /// std::invalid_argument on another size or entry count, std::runtime_error when A is not positive
    /// definite (with the node whose pivot failed) or not finite. After a throw there is no factor.
    void factorize(const SparseMatrix& A);

    bool factorized() const noexcept;

    /// x = A^-1 b. Allocates on the first call only. x may be b. Throws std::logic_error without a factor,
    /// std::runtime_error when CHOLMOD fails.
    void solve(const Eigen::Ref<const Eigen::VectorXd>& b, Eigen::Ref<Eigen::VectorXd> x) const;

    /// The factor's own arrays, valid until the next analyze() or factorize(). The three rows of a node stand
    /// together in L. Throws std::logic_error without a factor.
    SupernodalFactor factor() const;

    std::int64_t factor_entries() const noexcept;  // stored numbers of the factor, explicit zeros included

 private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace nbd
