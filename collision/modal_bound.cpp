#include "collision/modal_bound.hpp"

namespace nbd {

static_assert(Bound<ModalBound>);

ModalBound::ModalBound(const SphereTree& tree, const ModalModel& model)
    : tree_(&tree), model_(&model), zn_(Eigen::VectorXf::Zero(model.mode_count())) {}

void ModalBound::begin_pose(VerticesRef x) noexcept {
    align_ = modal_code(model_->modes, x, scratch_, zn_);
    zn_ = (zn_ - model_->z_centre).cwiseProduct(model_->z_scale);
}

}  // namespace nbd
