#include "sim/contact/bond.hpp"

#include <algorithm>

namespace nbd {

BondLaw::Terms BondLaw::at(const Eigen::Vector3d& d) const {
    const Eigen::Vector3d pull = K * d;
    Terms terms{.energy = d.dot(pull) / 2, .gradient = pull, .hessian = K};
    if (stiffness == 0 && damping == 0 && tension == 0) return terms;
    const bool is_radial = along.isZero(0);
    const double s = is_radial ? d.norm() : along.dot(d), stretch = s - length;
    if (pulls_only && stretch <= 0) return terms;
    Eigen::Vector3d e = along;
    if (is_radial) e = s > 0 ? Eigen::Vector3d(d / s) : Eigen::Vector3d::UnitX();
    const Eigen::Matrix3d outer = e * e.transpose();
    const double force = stiffness * stretch + tension;
    terms.energy += stiffness / 2 * stretch * stretch + tension * s;
    terms.gradient += force * e;
    terms.hessian += stiffness * outer;
    if (is_radial && s > 0) terms.hessian += std::max(force / s, 0.0) * (Eigen::Matrix3d::Identity() - outer);
    terms.drag = damping * outer;
    return terms;
}

}  // namespace nbd
