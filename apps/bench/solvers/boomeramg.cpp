#include <HYPRE.h>
#include <HYPRE_IJ_mv.h>
#include <HYPRE_parcsr_ls.h>
#include <mpi.h>

#include <Eigen/Geometry>
#include <array>
#include <numeric>
#include <vector>

#include "apps/bench/solvers/preconditioner.hpp"
#include "apps/bench/solvers/serial_mpi.hpp"

namespace nbd {
namespace {

/// Starts MPI and hypre, once.
struct StartedHypre {
    StartedHypre() { [[maybe_unused]] static const int once = HYPRE_Init(); }
    SerialMpi mpi;
};

/// A vector of hypre's, of one process.
class HypreVector {
 public:
    explicit HypreVector(int size) : indices_(static_cast<std::size_t>(size)) {
        std::iota(indices_.begin(), indices_.end(), 0);
        HYPRE_IJVectorCreate(MPI_COMM_SELF, 0, size - 1, &vector_);
        HYPRE_IJVectorSetObjectType(vector_, HYPRE_PARCSR);
        HYPRE_IJVectorInitialize(vector_);
        set(Eigen::VectorXd::Zero(size));
        HYPRE_IJVectorGetObject(vector_, reinterpret_cast<void**>(&object_));
    }
    HypreVector(const HypreVector&) = delete;
    HypreVector& operator=(const HypreVector&) = delete;
    ~HypreVector() { HYPRE_IJVectorDestroy(vector_); }

    void set(const Eigen::VectorXd& values) {
        HYPRE_IJVectorSetValues(vector_, static_cast<int>(indices_.size()), indices_.data(), values.data());
        HYPRE_IJVectorAssemble(vector_);
    }
    void get(Eigen::VectorXd& values) {
        HYPRE_IJVectorGetValues(vector_, static_cast<int>(indices_.size()), indices_.data(), values.data());
    }
    HYPRE_ParVector object() const { return object_; }

 private:
    std::vector<HYPRE_BigInt> indices_;
    HYPRE_IJVector vector_{};
    HYPRE_ParVector object_{};
};

class BoomerAmg final : public Preconditioner {
 public:
    BoomerAmg(const SparseMatrix& A, const Nodes& x)
        : r_(static_cast<int>(A.rows())),
          z_(static_cast<int>(A.rows())),
          rotations_{HypreVector(static_cast<int>(A.rows())), HypreVector(static_cast<int>(A.rows())),
                     HypreVector(static_cast<int>(A.rows()))} {
        copy(A);
        HYPRE_BoomerAMGCreate(&amg_);
        HYPRE_BoomerAMGSetNumFunctions(amg_, 3);
        HYPRE_BoomerAMGSetNodal(amg_, 4);
        HYPRE_BoomerAMGSetNodalDiag(amg_, 1);
        HYPRE_BoomerAMGSetCoarsenType(amg_, 10);  // HMIS
        HYPRE_BoomerAMGSetInterpType(amg_, 6);    // extended+i
        HYPRE_BoomerAMGSetPMaxElmts(amg_, 4);
        HYPRE_BoomerAMGSetStrongThreshold(amg_, 0.5);
        HYPRE_BoomerAMGSetRelaxOrder(amg_, 0);
        // l1 Gauss-Seidel, forward before and backward after the coarser level; elimination at the coarsest.
        HYPRE_BoomerAMGSetCycleRelaxType(amg_, 13, 1);
        HYPRE_BoomerAMGSetCycleRelaxType(amg_, 14, 2);
        HYPRE_BoomerAMGSetCycleRelaxType(amg_, 9, 3);
        HYPRE_BoomerAMGSetInterpVecVariant(amg_, 2);
        HYPRE_BoomerAMGSetInterpVecQMax(amg_, 4);
        rotate(x);
        for (std::size_t k = 0; k < 3; ++k) modes_[k] = rotations_[k].object();
        HYPRE_BoomerAMGSetInterpVectors(amg_, 3, modes_.data());
        HYPRE_BoomerAMGSetMaxIter(amg_, 1);
        HYPRE_BoomerAMGSetTol(amg_, 0);
        HYPRE_BoomerAMGSetPrintLevel(amg_, 0);
    }

    ~BoomerAmg() override {
        HYPRE_BoomerAMGDestroy(amg_);
        HYPRE_IJMatrixDestroy(matrix_);
    }

    void set_up() override {
        HYPRE_BoomerAMGSetup(amg_, parallel_, r_.object(), z_.object());
        HYPRE_ClearAllErrors();  // it sets some where all is well; a poor set-up shows in the residual
    }

    void apply(const Eigen::VectorXd& r, Eigen::VectorXd& z) override {
        r_.set(r);
        z_.set(Eigen::VectorXd::Zero(r.size()));
        HYPRE_BoomerAMGSolve(amg_, parallel_, r_.object(), z_.object());
        HYPRE_ClearAllErrors();  // that one cycle has not converged is no error here
        z.resize(r.size());
        z_.get(z);
    }

 private:
    void copy(const SparseMatrix& A) {
        const int n = static_cast<int>(A.rows());
        HYPRE_IJMatrixCreate(MPI_COMM_SELF, 0, n - 1, 0, n - 1, &matrix_);
        HYPRE_IJMatrixSetObjectType(matrix_, HYPRE_PARCSR);
        std::vector<int> lengths(static_cast<std::size_t>(n));
        for (int i = 0; i < n; ++i)
            lengths[static_cast<std::size_t>(i)] = A.outerIndexPtr()[i + 1] - A.outerIndexPtr()[i];
        HYPRE_IJMatrixSetRowSizes(matrix_, lengths.data());
        HYPRE_IJMatrixInitialize(matrix_);
        for (int i = 0; i < n; ++i) {  // a column is a row, since A is symmetric
            const int begin = A.outerIndexPtr()[i];
            HYPRE_IJMatrixSetValues(matrix_, 1, &lengths[static_cast<std::size_t>(i)], &i,
                                    A.innerIndexPtr() + begin, A.valuePtr() + begin);
        }
        HYPRE_IJMatrixAssemble(matrix_);
        HYPRE_IJMatrixGetObject(matrix_, reinterpret_cast<void**>(&parallel_));
    }

    /// Rotations about the three axes.
    void rotate(const Nodes& x) {
        for (int axis = 0; axis < 3; ++axis) {
            Eigen::VectorXd v(x.size());
            for (Eigen::Index i = 0; i < x.rows(); ++i) {
                const Eigen::Vector3d at = x.row(i);
                v.segment<3>(3 * i) = Eigen::Vector3d::Unit(axis).cross(at);
            }
            rotations_[static_cast<std::size_t>(axis)].set(v);
        }
    }

    StartedHypre started_;
    HypreVector r_, z_;
    std::array<HypreVector, 3> rotations_;
    std::array<HYPRE_ParVector, 3> modes_{};
    HYPRE_IJMatrix matrix_{};
    HYPRE_ParCSRMatrix parallel_{};
    HYPRE_Solver amg_{};
};

}  // namespace

std::unique_ptr<Preconditioner> make_boomeramg(const SparseMatrix& A, const Nodes& x) {
    return std::make_unique<BoomerAmg>(A, x);
}

}  // namespace nbd
