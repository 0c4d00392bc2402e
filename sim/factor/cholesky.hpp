#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "sim/factor/block_pattern.hpp"

namespace nbd {

/// Elimination order of the nodes.
enum class Ordering {
    thorough,  // better of minimum degree and nested dissection, for factors used many times
    quick,     // minimum degree
    given,     // that of the nodes: a matrix in the order of elimination_order() is factorised without being
               // permuted
};

/// An order of elimination with little fill: the node that comes first, second, ... lower: the lower half of
/// a pattern. ordering: not `given`. Throws as Cholesky::analyze().
std::vector<int> elimination_order(const BlockPattern& lower, Ordering ordering);

/// Sparse Cholesky factorisation (CHOLMOD, supernodal): analyse a pattern once, then factorise and solve for
/// many values. BLAS is limited to one thread, so the bits do not depend on the number of cores. One object
/// must not be used by several threads at once; different objects are independent.
class Cholesky {
 public:
    Cholesky();
    ~Cholesky();
    Cholesky(Cholesky&&) noexcept;
    Cholesky& operator=(Cholesky&&) noexcept;

    /// Computes a fill-reducing ordering and the symbolic factorisation. A: symmetric 3 N x 3 N of full 3x3
    /// blocks; only its pattern is read. Throws std::runtime_error if CHOLMOD fails (out of memory, too
    /// large).
    void analyze(const SparseMatrix& A, Ordering ordering = Ordering::thorough);

    /// Factorises a matrix of the analysed pattern; reads the lower triangle. Throws std::invalid_argument
    /// for another size or entry count, std::runtime_error if A is not finite or not positive definite
    /// (naming the node of the failed pivot). After a throw there is no factor.
    void factorize(const SparseMatrix& A);
    /// The same, but returns false if A is not positive definite.
    bool try_factorize(const SparseMatrix& A);

    bool factorized() const noexcept;

    /// x = A^-1 b. Allocates only on the first call. x may be b. Throws std::logic_error without a factor,
    /// std::runtime_error if CHOLMOD fails.
    void solve(const Eigen::Ref<const Eigen::VectorXd>& b, Eigen::Ref<Eigen::VectorXd> x) const;

 private:
    friend std::vector<int> elimination_order(const BlockPattern& lower, Ordering ordering);
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace nbd
