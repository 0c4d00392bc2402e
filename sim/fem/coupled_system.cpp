#include "sim/fem/coupled_system.hpp"

namespace nbd {

void CoupledSystem::multiply(const Eigen::VectorXd& v, Eigen::VectorXd& out) const {
    for (std::size_t b = 0; b < systems.size(); ++b) {
        const int first = first_unknown[b], size = first_unknown[b + 1] - first;
        systems[b].multiply(v.segment(first, size), out.segment(first, size));
    }
    add_couplings(v, out);
}

void CoupledSystem::add_couplings(const Eigen::VectorXd& v, Eigen::VectorXd& out) const {
    for (const Coupling& coupling : couplings) {
        if (coupling.A.isZero(0)) continue;
        Eigen::Vector3d u = Eigen::Vector3d::Zero();
        for (const CouplingTerm& t : terms_of(coupling)) u += t.weight * v.segment<3>(t.unknown);
        const Eigen::Vector3d impulse = coupling.A * u;
        for (const CouplingTerm& t : terms_of(coupling))
            if (!t.held) out.segment<3>(t.unknown) += t.weight * impulse;
    }
}

}  // namespace nbd
