#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

#include "meshing/parallel/parallel_for.hpp"
#include "sim/fem/step_system.hpp"

namespace nbd {

/// Norms of impulses body by body, in the inverse of the mass: sqrt(sum over nodes of |r_i|^2 / m_i), the
/// root of twice the kinetic energy that the impulses give to free nodes, sqrt(J). Nodes with prescribed
/// velocities do not count. No body's norm depends on another body. Sums are in a fixed order.
class BodyNorms {
 public:
    /// systems: prescribed.
    void begin(std::span<const StepSystem> systems, std::span<const int> first_unknown);

    /// The norms of r, [bodies]. prepare(begin, size) is called for each part of r before it is read.
    template <class Prepare>
    std::vector<double> of(const Eigen::VectorXd& r, const Prepare& prepare) const;
    std::vector<double> of(const Eigen::VectorXd& r) const;

    /// Calls visit(body, begin, size) for parts of the unknowns that together are all, in parallel.
    template <class Visit>
    void for_parts(const Visit& visit) const {
        parallel_for(
            std::ssize(parts_), [&](int k) { visit(parts_[k].body, parts_[k].begin, parts_[k].size); }, 1);
    }

 private:
    struct Part {
        std::size_t body;
        Eigen::Index begin, size;  // unknowns
    };
    std::vector<double> roots(const std::vector<double>& of_parts) const;

    std::vector<Part> parts_;  // of all bodies, in order
    std::size_t bodies_ = 0;
    Eigen::VectorXd inverse_mass_;  // [unknowns] 1/kg; 0 where prescribed
};

template <class Prepare>
std::vector<double> BodyNorms::of(const Eigen::VectorXd& r, const Prepare& prepare) const {
    std::vector<double> sums(parts_.size());
    parallel_for(
        parts_.size(),
        [&](int k) {
            const auto [body, begin, size] = parts_[k];
            prepare(begin, size);
            sums[k] =
                (r.segment(begin, size).array().square() * inverse_mass_.segment(begin, size).array()).sum();
        },
        1);
    return roots(sums);
}

/// The largest norm as a share of its body's goal; 0 where there is nothing left.
double worst_share(const std::vector<double>& norms, const std::vector<double>& goals) noexcept;

/// Norms, as BodyNorms has them, of what rounding leaves of b - A v at best.
std::vector<double> rounding_norms(const CoupledSystem& system, const BodyNorms& norms,
                                   const Eigen::VectorXd& b, const Eigen::VectorXd& v);

}  // namespace nbd
