#pragma once

#include <array>

#include "apps/bench/solvers/deflated_cycle.hpp"
#include "apps/bench/solvers/iteration_times.hpp"

namespace nbd {

/// Motions that our own preconditioner is deflated by: none, the rigid ones, and these with vibration modes.
inline constexpr std::array deflated_counts{0, 6, 16, 32};

/// The lowest vibration modes of a body: those of its file, or else made once.
class LowestModes {
 public:
    LowestModes(const Body& body, const ElasticBody& elastic);

    void make();
    const Eigen::MatrixXf& U() const noexcept { return U_; }
    double ms() const noexcept { return ms_; }  // that make() took

 private:
    static constexpr int most = deflated_counts.back() - DeflatedCycle::rigid_count;
    const ElasticBody& elastic_;
    int count_;
    Eigen::MatrixXf U_;  // [3 N, count_] or more
    double ms_ = 0;
};

/// The conjugate gradients of the rivals with our preconditioner, deflated by so many motions.
void time_deflated(const StepProblem& problem, LowestModes& modes, int count, const SolverRaceConfig& config,
                   SolverTiming& row);

}  // namespace nbd
