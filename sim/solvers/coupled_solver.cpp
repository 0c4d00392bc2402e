#include "sim/solvers/coupled_solver.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace nbd {
namespace {

constexpr float unlike = 0.2F;        // a node with a larger spread of rotations joins the patch
constexpr int layers = 2;             // layers of nodes added around the patch
constexpr int stale_iterations = 20;  // a factorisation costs more than this many iterations
constexpr double most_of_it = 0.5;    // maximum share of nodes in a patch; above it all are factorised

/// Adds the nodes that share a block with a node inside.
void grow(const CoupledSystem& system, std::vector<char>& inside) {
    const std::vector<char> core = inside;
    for (std::size_t b = 0; b < system.systems.size(); ++b) {
        const BlockPattern& pattern = system.systems[b].body().pattern();
        const int first = system.first_unknown[b] / 3;
        for (int i = 0; i < pattern.node_count(); ++i)
            if (core[static_cast<std::size_t>(first + i)])
                for (const int j : pattern.neighbours(i)) inside[static_cast<std::size_t>(first + j)] = 1;
    }
}

}  // namespace

CoupledSolver::CoupledSolver(const LinearSolveConfig& config, std::shared_ptr<RestFactors> factors)
    : config_(config), factors_(factors ? std::move(factors) : std::make_shared<RestFactors>()) {}

void CoupledSolver::begin_matrices(const CoupledSystem& system) {
    whole_ = config_.solver == LinearSolver::direct;
    factorized_ = false;
    patch_.begin();
    direct_.begin();
    if (whole_) return;
    rest_.resize(system.systems.size());
    rotations_.resize(system.systems.size());
    for (std::size_t b = 0; b < system.systems.size(); ++b) {
        const StepSystem& s = system.systems[b];
        rest_[b] = factors_->get(s.body(), s.mass_scale(), s.stiffness_scale(), s.prescribed());
        s.body().node_rotations(s.elements(), rotations_[b]);
    }
}

std::vector<char> CoupledSolver::choose_patch(const CoupledSystem& system) const {
    std::vector<char> inside(static_cast<std::size_t>(system.node_count()), 0);
    for (std::size_t b = 0; b < system.systems.size(); ++b) {
        const int first = system.first_unknown[b] / 3;
        for (int i = 0; i < system.systems[b].body().node_count(); ++i)
            inside[static_cast<std::size_t>(first + i)] =
                rotations_[b].spread[static_cast<std::size_t>(i)] > unlike;
    }
    for (const Coupling& coupling : system.couplings)
        if (!coupling.A.isZero(0))
            for (const CouplingTerm& t : system.terms_of(coupling))
                inside[static_cast<std::size_t>(t.unknown / 3)] = 1;
    for (int layer = 0; layer < layers; ++layer) grow(system, inside);
    return inside;
}

/// Without the direct factor: z = (I - A_S^-1 A) G r, where G are the rotated rest factors and S is the
/// patch. If r is zero on the patch, so is A z, and the residual there stays zero.
void CoupledSolver::precondition(const CoupledSystem& system, const Eigen::VectorXd& r, Eigen::VectorXd& z) {
    if (whole_) {
        z.setZero();
        direct_.add_solution(r, z);
        return;
    }
    for (std::size_t b = 0; b < system.systems.size(); ++b)
        rest_[b]->apply(rotations_[b], r.data() + system.first_unknown[b], z.data() + system.first_unknown[b],
                        y_, work_);
    patch_.correct(system, zero_, z);
}

/// Runs conjugate gradients; r_ must be the residual of v. Returns false if `most` iterations do not suffice.
bool CoupledSolver::iterate(const CoupledSystem& system, double goal, int most, Eigen::VectorXd& v,
                            LinearSolveReport& report) {
    if (r_.norm() <= goal) return true;
    precondition(system, r_, z_);
    p_ = z_;
    double rz = r_.dot(z_);
    for (int k = 0; k < most && rz > 0; ++k) {
        system.multiply(p_, Ap_);
        const double step = rz / p_.dot(Ap_);
        v += step * p_;
        r_ -= step * Ap_;
        ++report.iterations;
        if (r_.norm() <= goal) return true;
        precondition(system, r_, z_);
        const double next = r_.dot(z_);
        p_ = z_ + (next / rz) * p_;
        rz = next;
    }
    return false;
}

/// Solves with the current factors. The residual updated by the iteration may drift from the true one; if so,
/// there is a second round.
bool CoupledSolver::refine(const CoupledSystem& system, const Eigen::VectorXd& b, double goal, int most,
                           Eigen::VectorXd& v, LinearSolveReport& report) {
    const auto take_residual = [&] {
        system.multiply(v, Ap_);
        r_ = b - Ap_;
        return r_.norm();
    };
    bool going = true;
    for (int round = 0; round < 2 && going; ++round) {
        (whole_ ? direct_ : patch_).correct(system, b, v);
        take_residual();
        const bool iterated = iterate(system, goal, most, v, report);
        report.residual = take_residual();
        report.converged = report.residual <= goal;
        going = iterated && !report.converged;
    }
    if (!b.isZero(0)) report.residual /= b.norm();
    return report.converged;
}

/// Factorises the patch, or sets whole_ if the patch is too large.
void CoupledSolver::factorize_patch(const CoupledSystem& system, LinearSolveReport& report) {
    const std::vector<char> inside = choose_patch(system);
    report.patch_nodes = static_cast<int>(std::ranges::count(inside, 1));
    if (report.patch_nodes <= most_of_it * system.node_count()) {
        patch_.factorize(system, inside);
        report.patch_nodes = patch_.node_count();
        return;
    }
    report.fallback = fmt::format("the patch of contacts and unevenly rotated elements has {} of {} nodes",
                                  report.patch_nodes, system.node_count());
    whole_ = true;
}

LinearSolveReport CoupledSolver::solve(const CoupledSystem& system, const Eigen::VectorXd& b, double goal,
                                       Eigen::VectorXd& v) {
    LinearSolveReport report;
    for (Eigen::VectorXd* scratch : {&r_, &z_, &p_, &Ap_, &zero_}) scratch->setZero(system.size());
    if (!whole_) {
        factorize_patch(system, report);
        if (!whole_ && refine(system, b, goal, config_.max_iterations, v, report)) return report;
        if (!whole_)
            report.fallback = fmt::format("{} iterations left a relative residual of {:.2g}",
                                          report.iterations, report.residual);
        whole_ = true;
    }
    // The factor of an earlier solve with other couplings is worth a few iterations.
    if (factorized_ && refine(system, b, goal, stale_iterations, v, report)) return report;
    direct_.factorize(system, std::vector<char>(static_cast<std::size_t>(system.node_count()), 1));
    factorized_ = true;
    refine(system, b, goal, stale_iterations, v, report);
    return report;
}

}  // namespace nbd
