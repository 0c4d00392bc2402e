#include "sim/solvers/coupled_solver.hpp"

#include <fmt/format.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <utility>
#include <vector>

#include "meshing/parallel/parallel_for.hpp"

namespace nbd {
namespace {

constexpr Eigen::Index numbers_per_part = 8192;

/// Calls part(begin, size) for consecutive parts of [0, size), in parallel.
template <class Part>
void for_parts(Eigen::Index size, const Part& part) {
    parallel_for(
        static_cast<int>((size + numbers_per_part - 1) / numbers_per_part),
        [&](int k) { part(k * numbers_per_part, std::min(numbers_per_part, size - k * numbers_per_part)); },
        1);
}

/// Parts are summed in a fixed order.
double dot(const Eigen::VectorXd& a, const Eigen::VectorXd& b) {
    std::vector<double> sums((a.size() + numbers_per_part - 1) / numbers_per_part);
    for_parts(a.size(), [&](Eigen::Index begin, Eigen::Index size) {
        sums[begin / numbers_per_part] = a.segment(begin, size).dot(b.segment(begin, size));
    });
    return std::accumulate(sums.begin(), sums.end(), 0.0);
}

/// The cost of a factorisation grows with the square of the number of nodes, that of an iteration with the
/// number: at 10,000 nodes and at 100,000, a factorisation takes as long as some 70 and 500 iterations.
int most_iterations(const LinearSolveConfig& config, const CoupledSystem& system) {
    constexpr int nodes = 10'000;
    return config.max_iterations * std::max(1, system.node_count() / nodes);
}

constexpr int stale_iterations = 20;  // a factorisation costs more than this many iterations

}  // namespace

CoupledSolver::CoupledSolver(const LinearSolveConfig& config, std::shared_ptr<RestHierarchies> hierarchies)
    : config_(config),
      hierarchies_(hierarchies ? std::move(hierarchies) : std::make_shared<RestHierarchies>()) {}

void CoupledSolver::begin_matrices(const CoupledSystem& system) {
    direct_ = config_.solver == LinearSolver::direct;
    factorized_ = false;
    norms_.begin(system.systems, system.first_unknown);
    couplings_.begin(system);
    patch_.begin();
    factor_.begin();
    if (!direct_) cycle_.begin(system, *hierarchies_);
}

/// The wanted ones, or what rounding leaves at v.
void CoupledSolver::set_goals(const CoupledSystem& system, const Eigen::VectorXd& b,
                              const Eigen::VectorXd& v) {
    rounding_ = rounding_norms(system, norms_, b, v);
    goals_ = wanted_;
    for (std::size_t k = 0; k < goals_.size(); ++k) goals_[k] = std::max(goals_[k], rounding_[k]);
}

/// r_ = b - A v. Returns the largest norm of a body's part, as a share of its goal.
double CoupledSolver::take_residual(const CoupledSystem& system, const Eigen::VectorXd& b,
                                    const Eigen::VectorXd& v) {
    system.multiply(v, Ap_);
    return worst_share(norms_.of(r_,
                                 [&](Eigen::Index begin, Eigen::Index size) {
                                     r_.segment(begin, size) =
                                         b.segment(begin, size) - Ap_.segment(begin, size);
                                 }),
                       goals_);
}

/// z_ = about A^-1 r_, Az_ = A z_. norm: about that of r_; after scaling, floats can hold any residual.
void CoupledSolver::precondition(const CoupledSystem& system, double norm) {
    if (direct_) {
        z_.setZero();
        factor_.add_solution(r_, z_);
        system.multiply(z_, Az_);
        return;
    }
    for_parts(r_.size(), [&](Eigen::Index begin, Eigen::Index size) {
        cycle_in_.segment(begin, size) = (r_.segment(begin, size) / norm).cast<float>();
    });
    cycle_.apply(cycle_in_, cycle_out_);
    for_parts(r_.size(), [&](Eigen::Index begin, Eigen::Index size) {
        z_.segment(begin, size) = norm * cycle_out_.segment(begin, size).cast<double>();
    });
    cycle_.take_residual(cycle_out_);
    for_parts(r_.size(), [&](Eigen::Index begin, Eigen::Index size) {
        Az_.segment(begin, size) = norm * cycle_out_.segment(begin, size).cast<double>();
    });
    // Az_ is what is left of r_, which is zero on the patch. There contacts make the cycle's rounding too
    // large.
    patch_.take_residual(system, couplings_, z_, Az_);
    patch_.clear(system, Az_, z_);
    for_parts(r_.size(), [&](Eigen::Index begin, Eigen::Index size) {
        Az_.segment(begin, size) = r_.segment(begin, size) - Az_.segment(begin, size);
    });
}

/// Conjugate gradients from r_, the residual of v, until the updated residual reaches the goals or the
/// maximum number of iterations is reached. Ap_ follows p_ from Az_, without a product of its own.
void CoupledSolver::iterate(const CoupledSystem& system, int most, Eigen::VectorXd& v,
                            LinearSolveReport& report) {
    const double norm = std::sqrt(dot(r_, r_));
    if (!(norm > 0)) return;  // all that was left lay in the patch
    precondition(system, norm);
    p_ = z_;
    Ap_ = Az_;
    double rz = dot(r_, z_);
    while (report.iterations < most && rz > 0) {
        const double energy = dot(p_, Ap_);
        if (!(energy > 0)) return;
        const double step = rz / energy;
        const std::vector<double> left = norms_.of(r_, [&](Eigen::Index begin, Eigen::Index size) {
            v.segment(begin, size) += step * p_.segment(begin, size);
            r_.segment(begin, size) -= step * Ap_.segment(begin, size);
        });
        ++report.iterations;
        if (!(worst_share(left, goals_) > 1)) return;
        precondition(system, norm);
        const double next = dot(r_, z_);
        for_parts(v.size(), [&](Eigen::Index begin, Eigen::Index size) {
            p_.segment(begin, size) = z_.segment(begin, size) + (next / rz) * p_.segment(begin, size);
            Ap_.segment(begin, size) = Az_.segment(begin, size) + (next / rz) * Ap_.segment(begin, size);
        });
        rz = next;
    }
}

/// Adds what the factor finds for the residual `left` of v, again and again as long as that gains two digits:
/// the factor is that of a matrix in single precision. Returns what is left.
double CoupledSolver::refine_directly(const CoupledSystem& system, const Eigen::VectorXd& b, double left,
                                      Eigen::VectorXd& v) {
    constexpr double gain = 0.01;
    for (double before = std::numeric_limits<double>::infinity(); left > 1 && left <= gain * before;) {
        before = left;
        const Eigen::VectorXd best = v;
        factor_.add_solution(r_, v);
        left = take_residual(system, b, v);
        if (left <= before) continue;
        v = best;
        return take_residual(system, b, v);
    }
    return left;
}

/// Solves with the current preconditioner, by at most this number of iterations in all. The residual updated
/// by the iteration drifts from the true one, by rounding; further rounds remove what is left.
bool CoupledSolver::refine(const CoupledSystem& system, const Eigen::VectorXd& b, int most,
                           Eigen::VectorXd& v, LinearSolveReport& report) {
    constexpr double progress = 0.5;  // a round must leave no more than this share of the residual
    double before = std::numeric_limits<double>::infinity(), left = 0;
    for (;;) {
        set_goals(system, b, v);
        left = take_residual(system, b, v);
        if (direct_) left = refine_directly(system, b, left, v);
        if (left <= 1 || !(left <= progress * before) || report.iterations >= most) break;
        // The preconditioner, which ends with the patch, is symmetric only for residuals that vanish there.
        if (!direct_) patch_.clear(system, r_, v);
        iterate(system, most, v, report);
        before = left;
    }
    report.converged = left <= 1;
    report.residual = left;
    return report.converged;
}

/// Factorises the patch of nodes in contact and of rigid bodies. Returns whether it has a factor.
bool CoupledSolver::factorize_contacts(const CoupledSystem& system) {
    std::vector<char> inside(system.node_count(), 0);
    for (const Coupling& coupling : system.couplings)
        if (coupling.end - coupling.begin > 1 && !coupling.A.isZero(0))
            for (const CouplingTerm& t : system.terms_of(coupling)) inside[t.unknown / 3] = 1;
    for (std::size_t b = 0; b < system.systems.size(); ++b)
        if (system.systems[b].body().is_rigid())
            std::fill(inside.begin() + system.first_unknown[b] / 3,
                      inside.begin() + system.first_unknown[b + 1] / 3, 1);
    return patch_.factorize(system, couplings_, inside);
}

/// Takes over the couplings as they are. Without a factor of the nodes in contact, the solver becomes direct.
void CoupledSolver::begin_solve(const CoupledSystem& system, const std::vector<double>& goals) {
    for (Eigen::VectorXd* scratch : {&r_, &z_, &Az_, &p_, &Ap_}) scratch->resize(system.size());
    for (Eigen::VectorXf* scratch : {&cycle_in_, &cycle_out_}) scratch->resize(system.size());
    couplings_.update(system);
    wanted_ = goals;
    direct_ = direct_ || !factorize_contacts(system);
    if (!direct_) cycle_.set_couplings(couplings_);
}

LinearSolveReport CoupledSolver::solve_roughly(const CoupledSystem& system, const Eigen::VectorXd& b,
                                               const Eigen::VectorXd& change,
                                               const std::vector<double>& goals, Eigen::VectorXd& v) {
    if (direct_) return solve(system, b, goals, v);
    r_ += change;
    begin_solve(system, goals);
    if (direct_) return solve(system, b, goals, v);
    set_goals(system, b, v);
    LinearSolveReport report;
    patch_.clear(system, r_, v);
    iterate(system, most_iterations(config_, system), v, report);
    report.residual = worst_share(norms_.of(r_), goals_);
    report.converged = report.residual <= 1;
    return report.converged ? report : solve(system, b, goals, v);
}

LinearSolveReport CoupledSolver::solve(const CoupledSystem& system, const Eigen::VectorXd& b,
                                       const std::vector<double>& goals, Eigen::VectorXd& v) {
    if (!b.allFinite()) throw std::runtime_error("solve: the right-hand side holds a NaN or an infinity");
    // Residuals are measured against its norm; an infinite one would let any velocities pass.
    if (!std::isfinite(b.squaredNorm()))
        throw std::runtime_error("solve: the right-hand side is too large, its squared norm overflows");
    LinearSolveReport report;
    for (std::size_t k = 0; k < system.systems.size(); ++k)
        for (int i = 0; i < system.systems[k].body().node_count(); ++i)
            if (system.systems[k].is_prescribed(i))
                v.segment<3>(system.first_unknown[k] + 3 * i) = b.segment<3>(system.first_unknown[k] + 3 * i);
    const bool was_direct = direct_;
    begin_solve(system, goals);
    if (direct_ && !was_direct)
        report.fallback = "the matrix of the nodes in contact is not positive definite";
    if (!direct_) {
        if (refine(system, b, most_iterations(config_, system), v, report)) return report;
        report.fallback = fmt::format("{} iterations left {:.2g} times the residual that is allowed",
                                      report.iterations, report.residual);
        direct_ = true;
    }
    // The factor of an earlier solve with other couplings is worth a few iterations.
    const int most = report.iterations + stale_iterations;
    if (factorized_ && refine(system, b, most, v, report)) return report;
    factor_.factorize_nearly(system, couplings_, std::vector<char>(system.node_count(), 1));
    factorized_ = true;
    refine(system, b, most + stale_iterations, v, report);
    return report;
}

}  // namespace nbd
