#include "sim/solvers/body_norms.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace nbd {

void BodyNorms::begin(std::span<const StepSystem> systems, std::span<const int> first_unknown) {
    constexpr Eigen::Index per_part = 8192;
    bodies_ = systems.size();
    parts_.clear();
    inverse_mass_.resize(first_unknown.back());
    for (std::size_t b = 0; b < systems.size(); ++b) {
        const Eigen::Index first = first_unknown[b], end = first_unknown[b + 1];
        for (Eigen::Index begin = first; begin < end; begin += per_part)
            parts_.push_back({b, begin, std::min(per_part, end - begin)});
        const Eigen::VectorXd& masses = systems[b].body().node_masses();
        for (int i = 0; i < systems[b].body().node_count(); ++i)
            inverse_mass_.segment<3>(first + 3 * i)
                .setConstant(systems[b].is_prescribed(i) ? 0 : 1 / masses[i]);
    }
}

std::vector<double> BodyNorms::of(const Eigen::VectorXd& r) const {
    return of(r, [](Eigen::Index, Eigen::Index) {});
}

std::vector<double> BodyNorms::roots(const std::vector<double>& of_parts) const {
    std::vector<double> sums(bodies_, 0.0);
    for (std::size_t k = 0; k < parts_.size(); ++k) sums[parts_[k].body] += of_parts[k];
    for (double& sum : sums) sum = std::sqrt(sum);
    return sums;
}

double worst_share(const std::vector<double>& norms, const std::vector<double>& goals) noexcept {
    double worst = 0;
    for (std::size_t b = 0; b < norms.size(); ++b) {
        if (norms[b] == 0) continue;
        const double share = norms[b] / goals[b];
        if (!(share <= worst)) worst = share;  // NaN, too
    }
    return worst;
}

// A product rounds each of its terms, and v itself is rounded: a row of A is about twice its diagonal block.
std::vector<double> rounding_norms(const CoupledSystem& system, const BodyNorms& norms,
                                   const Eigen::VectorXd& b, const Eigen::VectorXd& v) {
    constexpr double unit = 4 * std::numeric_limits<double>::epsilon();
    Eigen::VectorXd noise(system.size());
    norms.for_parts([&](std::size_t body, Eigen::Index begin, Eigen::Index size) {
        const auto& diagonal = system.systems[body].matrix().diagonal();
        const Eigen::Index first = system.first_unknown[body];
        // Of nodes that begin in the part.
        for (Eigen::Index at = first + 3 * ((begin - first + 2) / 3); at < begin + size; at += 3) {
            const double product = 2 * diagonal[(at - first) / 3].norm() * v.segment<3>(at).norm();
            noise.segment<3>(at) = unit * (b.segment<3>(at).cwiseAbs().array() + product);
        }
    });
    for (const Coupling& coupling : system.couplings) {
        const double size = coupling.A.norm();
        if (size == 0) continue;
        double speed = 0;
        for (const CouplingTerm& t : system.terms_of(coupling))
            speed += std::abs(t.weight) * v.segment<3>(t.unknown).norm();
        for (const CouplingTerm& t : system.terms_of(coupling))
            noise.segment<3>(t.unknown).array() += unit * std::abs(t.weight) * size * speed;
    }
    return norms.of(noise);
}

}  // namespace nbd
