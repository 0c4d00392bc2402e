#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "sim/fem/step_system.hpp"
#include "sim/multilevel/coarsest_solve.hpp"
#include "sim/multilevel/coupled_level.hpp"
#include "sim/multilevel/coupling_sum.hpp"
#include "sim/multilevel/rest_hierarchy.hpp"

namespace nbd {

/// A preconditioner of a coupled system, symmetric and positive definite: a multilevel V-cycle in single
/// precision, with coarser levels that are stored in 16 bits. It smooths with the actual matrix of the nodes.
/// The coarser levels are those of the rest pose, turned with the nodes, and have the couplings of the step.
/// The coarsest level of all bodies is solved directly; the more bodies, the coarser it is.
class MultilevelCycle {
 public:
    /// Begins the matrices of a step, whose couplings are to be set next. The system must outlive the cycles.
    void begin(const CoupledSystem& system, RestHierarchies& hierarchies);

    /// Takes the couplings of the system. In a step, coarser levels follow only once a fifth of those that
    /// act are others. Throws std::runtime_error if the coarsest matrix is not positive definite.
    void set_couplings(const CouplingSum& couplings);

    /// z = about A^-1 r. r, z: [unknowns]. The couplings of the step must have been set.
    void apply(const Eigen::VectorXf& r, Eigen::VectorXf& z);

    /// residual = r - A z of the last apply(r, z), at half the price of a product. residual: [unknowns].
    void take_residual(Eigen::VectorXf& residual);

    /// Number of aggregates of all bodies at the level that is factorised.
    int coarsest_rows() const noexcept { return levels_.empty() ? 0 : levels_.back().rows(); }

 private:
    using Level = CoupledLevel<6>;

    void begin_nodes(const CoupledSystem& system);
    void begin_aggregates();
    void forget_couplings();
    bool follows(const std::vector<double>& strengths) const;
    CouplingMatrix<6> coarsen_nodes(const CouplingMatrix<3>& couplings) const;
    CouplingMatrix<6> coarsen_level(std::size_t level, const CouplingMatrix<6>& couplings) const;
    void restrict_nodes();
    void prolong_to_nodes();
    void move_between(std::size_t level, TransferMatrix<6, 6> Transfer<6>::*transfer,
                      std::span<const float> from, std::span<float> to) const;
    const RestLevel& rest_level(std::size_t body, std::size_t level) const;
    bool is_coarsened(std::size_t body, std::size_t level) const;

    std::vector<std::shared_ptr<const RestHierarchy>> hierarchies_;  // [bodies]
    std::vector<std::size_t> depth_;                                 // [bodies] number of levels in use
    std::vector<std::vector<Eigen::Matrix3f>> rotations_;            // [bodies][nodes]
    bool has_aggregates_ = false;                                    // levels_ are of the hierarchies
    CoupledLevel<3> nodes_;
    std::vector<Level> levels_;                     // finest first
    std::vector<float> turned_;                     // [unknowns] residual in the rest frame
    std::optional<std::vector<double>> strengths_;  // [couplings] at coarser levels; none: not set
    CoarsestSolve coarsest_;
};

}  // namespace nbd
