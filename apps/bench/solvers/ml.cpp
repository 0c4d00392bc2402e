#include <Epetra_CrsMatrix.h>
#include <Epetra_Map.h>
#include <Epetra_MpiComm.h>
#include <Epetra_Vector.h>
#include <ml_MultiLevelPreconditioner.h>
#include <mpi.h>

#include <Teuchos_ParameterList.hpp>
#include <stdexcept>
#include <vector>

#include "apps/bench/solvers/preconditioner.hpp"
#include "apps/bench/solvers/serial_mpi.hpp"
#include "sim/multilevel/rigid_modes.hpp"

namespace nbd {
namespace {

std::vector<int> row_lengths(const SparseMatrix& A) {
    std::vector<int> lengths;
    for (int i = 0; i < A.rows(); ++i) lengths.push_back(A.outerIndexPtr()[i + 1] - A.outerIndexPtr()[i]);
    return lengths;
}

class Ml final : public Preconditioner {
 public:
    Ml(const SparseMatrix& A, const Nodes& x)
        : comm_(MPI_COMM_SELF),
          map_(static_cast<int>(A.rows()), 0, comm_),
          matrix_(Copy, map_, row_lengths(A).data()),
          modes_(static_cast<std::size_t>(6 * A.rows())) {
        for (int i = 0; i < A.rows(); ++i) {  // a column is a row, since A is symmetric
            const int begin = A.outerIndexPtr()[i], count = A.outerIndexPtr()[i + 1] - begin;
            matrix_.InsertGlobalValues(i, count, A.valuePtr() + begin, A.innerIndexPtr() + begin);
        }
        matrix_.FillComplete();
        const RigidModes<3> rigid = rigid_modes(x);
        for (Eigen::Index i = 0; i < x.rows(); ++i)
            for (Eigen::Index mode = 0; mode < 6; ++mode)
                for (Eigen::Index axis = 0; axis < 3; ++axis)
                    modes_[static_cast<std::size_t>(mode * A.rows() + 3 * i + axis)] =
                        rigid[static_cast<std::size_t>(i)](axis, mode);
        Teuchos::ParameterList list;
        ML_Epetra::SetDefaults("SA", list);
        list.set("ML output", 0);
        list.set("PDE equations", 3);
        list.set("aggregation: type", "Uncoupled");
        list.set("aggregation: threshold", 0.01);
        list.set("smoother: type", "symmetric block Gauss-Seidel");
        list.set("smoother: sweeps", 1);
        list.set("coarse: type", "Amesos-KLU");
        list.set("null space: type", "pre-computed");
        list.set("null space: add default vectors", false);
        list.set("null space: dimension", 6);
        list.set("null space: vectors", modes_.data());
        ml_ = std::make_unique<ML_Epetra::MultiLevelPreconditioner>(matrix_, list, false);
    }

    void set_up() override {
        if (ml_->ComputePreconditioner() != 0)
            throw std::runtime_error("ML's preconditioner cannot be set up");
    }

    void apply(const Eigen::VectorXd& r, Eigen::VectorXd& z) override {
        z.resize(r.size());
        const Epetra_Vector in(View, map_, const_cast<double*>(r.data()));
        Epetra_Vector out(View, map_, z.data());
        ml_->ApplyInverse(in, out);
    }

 private:
    SerialMpi mpi_;
    Epetra_MpiComm comm_;
    Epetra_Map map_;
    Epetra_CrsMatrix matrix_;
    std::vector<double> modes_;
    std::unique_ptr<ML_Epetra::MultiLevelPreconditioner> ml_;
};

}  // namespace

std::unique_ptr<Preconditioner> make_ml(const SparseMatrix& A, const Nodes& x) {
    return std::make_unique<Ml>(A, x);
}

}  // namespace nbd
