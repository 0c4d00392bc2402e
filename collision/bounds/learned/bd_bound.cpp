#include "collision/bounds/learned/bd_bound.hpp"

namespace nbd {

static_assert(Bound<BdBound>);

BdBound::BdBound(const SphereTree& tree, const BdModel& model)
    : tree_(&tree), model_(&model), z_(Eigen::VectorXf::Zero(model.modes.U.cols())), q_(z_), abs_q_(z_) {
    scratch_.fit(model.modes.X.rows());
}

void BdBound::begin_pose(VerticesRef x) noexcept {
    align_ = modal_coordinates(model_->modes, x, scratch_, z_);
    q_.noalias() = model_->z_to_q * z_;
    abs_q_ = q_.cwiseAbs();
}

Sphere BdBound::bound(int node) const noexcept {
    const Eigen::Index column = 3 * Eigen::Index{node};
    const Sphere& rest = tree_->rest[node];
    const Eigen::Vector3f shift(model_->Ubar.col(column).dot(q_), model_->Ubar.col(column + 1).dot(q_),
                                model_->Ubar.col(column + 2).dot(q_));
    return to_world(align_, {rest.c + shift, rest.r + model_->dr.col(node).dot(abs_q_)});
}

}  // namespace nbd
