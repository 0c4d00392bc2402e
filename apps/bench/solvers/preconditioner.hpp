#pragma once

#include <Eigen/Core>
#include <memory>
#include <string>
#include <vector>

#include "meshing/surface/mesh.hpp"
#include "sim/factor/block_pattern.hpp"

namespace nbd {

/// z = B r, where B is an approximate inverse of a matrix, symmetric and positive definite, at least for the
/// residuals that follow from guess().
class Preconditioner {
 public:
    Preconditioner() = default;
    Preconditioner(const Preconditioner&) = delete;
    Preconditioner& operator=(const Preconditioner&) = delete;
    virtual ~Preconditioner() = default;
    /// What is to be done for each new matrix.
    virtual void set_up() = 0;
    virtual void apply(const Eigen::VectorXd& r, Eigen::VectorXd& z) = 0;
    /// Sets v to what the conjugate gradients are to start from instead of zero; returns whether it does.
    virtual bool guess(const Eigen::VectorXd& /*b*/, Eigen::VectorXd& /*v*/) { return false; }
};

/// A preconditioner for A before its set_up(): A is copied to the library's own format. A must outlive it. x:
/// [N, 3] positions of the nodes; A times a rigid motion of these is small.
using MakePreconditioner = std::unique_ptr<Preconditioner> (*)(const SparseMatrix& A, const Nodes& x);

struct PreconditionerEntry {
    std::string name;
    MakePreconditioner make;
};

/// Incomplete Cholesky factors, and hypre's and Trilinos' algebraic multigrid where this program was built
/// with them.
std::vector<PreconditionerEntry> rival_preconditioners();

/// Rivals that this program was built without, a line each.
std::vector<std::string> missing_preconditioners();

std::unique_ptr<Preconditioner> make_incomplete_cholesky(const SparseMatrix& A, const Nodes& x);
/// hypre's BoomerAMG for elasticity: three unknowns a node, rotations interpolated [Baker10].
std::unique_ptr<Preconditioner> make_boomeramg(const SparseMatrix& A, const Nodes& x);
/// Smoothed aggregation with six rigid motions, by Trilinos' ML.
std::unique_ptr<Preconditioner> make_ml(const SparseMatrix& A, const Nodes& x);

}  // namespace nbd
