#include "apps/bench/solvers/deflated_cycle.hpp"

#include <span>
#include <stdexcept>

#include "sim/multilevel/rigid_modes.hpp"

namespace nbd {

DeflatedCycle::DeflatedCycle(const StepProblem& problem, const Eigen::MatrixXf& modes, int count)
    : problem_(problem),
      modes_(modes),
      first_unknown_{0, static_cast<int>(problem.b.size())},
      system_{.systems = {&problem.system, 1}, .first_unknown = first_unknown_, .terms = {}, .couplings = {}},
      W_(problem.b.size(), count) {
    for (Eigen::VectorXf* scratch : {&in_, &out_, &left_}) scratch->resize(problem.b.size());
}

void DeflatedCycle::set_up() {
    cycle_.begin(system_, hierarchies_);
    couplings_.begin(system_);
    couplings_.update(system_);
    cycle_.set_couplings(couplings_);
    if (W_.cols() == 0) return;
    turn_modes();
    factorize();
}

void DeflatedCycle::turn_modes() {
    const StepSystem& system = problem_.system;
    const RigidModes<3> rigid = rigid_modes(problem_.x);
    const Eigen::Index turned = W_.cols() - rigid_count;
    system.body().node_rotations(system.elements(), rotations_);
    for (int i = 0; i < system.body().node_count(); ++i) {
        auto row = W_.middleRows<3>(3 * i);
        if (system.is_prescribed(i)) {
            row.setZero();
            continue;
        }
        row.leftCols<rigid_count>() = rigid[static_cast<std::size_t>(i)].cast<float>();
        if (turned > 0)
            row.rightCols(turned) =
                rotations_[static_cast<std::size_t>(i)].lazyProduct(modes_.block(3 * i, 0, 3, turned));
    }
}

/// E, row by row of A and from its upper half, so that A W is never stored.
void DeflatedCycle::factorize() {
    const StepMatrix& A = problem_.system.matrix();
    const BlockPattern& pattern = problem_.system.body().pattern();
    Eigen::MatrixXd half = Eigen::MatrixXd::Zero(W_.cols(), W_.cols());
    Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::RowMajor> row(3, W_.cols());
    const auto W = [&](int node) { return W_.middleRows<3>(3 * node).cast<double>(); };
    for (int i = 0; i < pattern.node_count(); ++i) {
        if (problem_.system.is_prescribed(i)) continue;
        row.setZero();
        const std::span<const int> neighbours = pattern.neighbours(i);
        for (std::size_t k = 0; k < neighbours.size(); ++k)
            if (const int j = neighbours[k]; j >= i)
                row += ((i == j ? 0.5 : 1) * A.block(i, static_cast<int>(k))).lazyProduct(W(j));
        half.noalias() += W(i).transpose().lazyProduct(row);
    }
    E_.compute(half + half.transpose());
    if (E_.info() != Eigen::Success)
        throw std::runtime_error("the matrix of the deflated modes is not positive definite");
}

bool DeflatedCycle::guess(const Eigen::VectorXd& b, Eigen::VectorXd& v) {
    if (W_.cols() == 0) return false;
    const Eigen::VectorXd y = E_.solve((W_.transpose() * b.cast<float>()).cast<double>());
    v = (W_ * y.cast<float>()).cast<double>();
    return true;
}

void DeflatedCycle::apply(const Eigen::VectorXd& r, Eigen::VectorXd& z) {
    const double norm = r.norm();
    in_ = (r / norm).cast<float>();  // floats can hold any residual of this size
    cycle_.apply(in_, out_);
    if (W_.cols() > 0) {
        cycle_.take_residual(left_);
        const Eigen::VectorXd y = E_.solve((W_.transpose() * left_).cast<double>());
        out_.noalias() += W_ * y.cast<float>();
    }
    z = norm * out_.cast<double>();
}

}  // namespace nbd
