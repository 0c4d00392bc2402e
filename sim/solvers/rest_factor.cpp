#include "sim/solvers/rest_factor.hpp"

#include <algorithm>

namespace nbd {
namespace {

constexpr std::size_t max_entries = 32;  // the oldest entry is dropped beyond this number

PackedFactor factorize_rest(const ElasticBody& body, double mass_scale, double stiffness_scale,
                            const std::vector<char>& prescribed) {
    ElementPose pose;
    body.pose(body.rest().X, pose);
    SparseMatrix A = body.pattern().zero_matrix();
    body.combine(mass_scale, stiffness_scale, pose, A);
    for (int i = 0; i < body.node_count(); ++i)
        if (prescribed[static_cast<std::size_t>(i)]) body.pattern().isolate(A, i);
    Cholesky cholesky;
    cholesky.analyze(A);
    cholesky.factorize(A);
    return PackedFactor(cholesky.factor());
}

}  // namespace

RestFactor::RestFactor(const ElasticBody& body, double mass_scale, double stiffness_scale,
                       const std::vector<char>& prescribed)
    : factor_(factorize_rest(body, mass_scale, stiffness_scale, prescribed)) {}

void RestFactor::apply(const NodeRotations& rotations, const double* r, double* z, std::vector<float>& y,
                       std::vector<float>& work) const {
    y.resize(static_cast<std::size_t>(factor_.size()));
    const std::vector<int>& order = factor_.order();
    // After scaling, floats can hold any residual.
    const double size = Eigen::Map<const Eigen::VectorXd>(r, factor_.size()).cwiseAbs().maxCoeff();
    const double scale = size > 0 ? 1 / size : 1;
    using Point = Eigen::Map<Eigen::Vector3f>;
    for (std::size_t k = 0; k < order.size(); k += 3) {
        const int unknown = order[k];
        const Eigen::Vector3f part = (scale * Eigen::Map<const Eigen::Vector3d>(r + unknown)).cast<float>();
        Point(y.data() + k).noalias() = rotations.R[static_cast<std::size_t>(unknown / 3)].transpose() * part;
    }
    factor_.solve(y, work);
    for (std::size_t k = 0; k < order.size(); k += 3) {
        const int unknown = order[k];
        const Eigen::Vector3f part = rotations.R[static_cast<std::size_t>(unknown / 3)] * Point(y.data() + k);
        Eigen::Map<Eigen::Vector3d>(z + unknown) = part.cast<double>() / scale;
    }
}

std::shared_ptr<const RestFactor> RestFactors::get(const ElasticBody& body, double mass_scale,
                                                   double stiffness_scale,
                                                   const std::vector<char>& prescribed) {
    const std::lock_guard lock(mutex_);
    const auto known = std::ranges::find_if(entries_, [&](const Entry& e) {
        return e.body == &body && e.mass_scale == mass_scale && e.stiffness_scale == stiffness_scale &&
               e.prescribed == prescribed;
    });
    if (known != entries_.end()) return known->factor;
    if (entries_.size() == max_entries) entries_.erase(entries_.begin());
    entries_.push_back({&body, mass_scale, stiffness_scale, prescribed,
                        std::make_shared<const RestFactor>(body, mass_scale, stiffness_scale, prescribed)});
    return entries_.back().factor;
}

}  // namespace nbd
