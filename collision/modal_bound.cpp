#include "collision/modal_bound.hpp"

#include <cmath>

namespace nbd {

static_assert(GatedBound<ModalBound>);

ModalBound::ModalBound(const SphereTree& tree, const ModalModel& model)
    : tree_(&tree),
      model_(&model),
      z_(Eigen::VectorXf::Zero(model.mode_count())),
      zn_(z_),
      explained_(Eigen::VectorXf::Zero(model.modes.U.rows())) {}

void ModalBound::begin_pose(VerticesRef x) noexcept {
    align_ = modal_code(model_->modes, x, scratch_, z_);
    zn_ = (z_ - model_->z_centre).cwiseProduct(model_->z_scale);
    unexplained_ = -1;
}

float ModalBound::strangeness(int) noexcept {
    if (unexplained_ < 0) {
        const ClusteredModes& modes = model_->modes;
        explained_.noalias() = modes.U * z_;
        double sum = 0;
        for (Eigen::Index i = 0; i < modes.w.size(); ++i) {
            const float w = modes.w[i];  // that the code's differences are weighted with
            const Eigen::Vector3f moved = scratch_.d.segment<3>(3 * i) / w;
            sum += static_cast<double>(w * (moved - explained_.segment<3>(3 * i)).squaredNorm());
        }
        unexplained_ =
            static_cast<float>(std::sqrt(sum / static_cast<double>(modes.w.sum()))) / tree_->rest[0].r;
    }
    return unexplained_;
}

}  // namespace nbd
