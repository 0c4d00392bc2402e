#include "collision/nbd_tree/posed_nbd_tree.hpp"

namespace nbd {

void PosedNbdTree::begin_pose(const VertexView& x) noexcept {
    x_ = x;
    std::visit([&](auto& bounds) { bounds.begin_pose(x.rows()); }, bounds_);
    spheres_.begin_pose(x);
    leaves_.begin_pose(x);
}

void PosedNbdTree::forget_pose() noexcept {
    x_ = {};
    spheres_.forget_pose();
    leaves_.begin_pose({});
}

const Sphere& PosedNbdTree::sphere(int node) noexcept {
    return std::visit([&](auto& bounds) -> const Sphere& { return spheres_.get(node, bounds); }, bounds_);
}

void PosedNbdTree::require_finite() const {
    const auto* exact = std::get_if<ExactBound>(&bounds_);
    const bool met_non_finite =
        (exact && exact->met_non_finite()) || spheres_.met_non_finite() || leaves_.met_non_finite();
    if (has_pose() && met_non_finite) require_finite_rows("vertex", x_);
}

}  // namespace nbd
