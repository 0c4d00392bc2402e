#include <Eigen/IterativeLinearSolvers>
#include <stdexcept>

#include "apps/bench/solvers/preconditioner.hpp"

namespace nbd {
namespace {

class IncompleteCholesky final : public Preconditioner {
 public:
    explicit IncompleteCholesky(const SparseMatrix& A) : A_(A) { factor_.analyzePattern(A); }

    void set_up() override {
        factor_.factorize(A_);
        if (factor_.info() != Eigen::Success)
            throw std::runtime_error("the incomplete Cholesky factorisation failed");
    }

    void apply(const Eigen::VectorXd& r, Eigen::VectorXd& z) override { z = factor_.solve(r); }

 private:
    const SparseMatrix& A_;
    Eigen::IncompleteCholesky<double> factor_;
};

}  // namespace

std::unique_ptr<Preconditioner> make_incomplete_cholesky(const SparseMatrix& A, const Nodes& /*x*/) {
    return std::make_unique<IncompleteCholesky>(A);
}

}  // namespace nbd
