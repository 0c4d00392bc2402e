#include "collision/nbd_tree/posed_nbd_tree.hpp"

#include <type_traits>

namespace nbd {

void PosedNbdTree::begin_pose(const Positions& x) noexcept {
    x_ = x;
    std::visit(
        [&](auto& bounds) {
            if constexpr (requires { bounds.representatives(); })
                x.require(bounds.representatives());
            else
                x.require_all();
            bounds.begin_pose(x.rows());
        },
        bounds_);
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

std::optional<float> PosedNbdTree::ood_score(int node) noexcept {
    return std::visit(
        [node](auto& bounds) -> std::optional<float> {
            if constexpr (GatedBound<std::remove_cvref_t<decltype(bounds)>>) {
                bounds.bound(node);
                return bounds.ood_score(node);
            } else {
                return std::nullopt;
            }
        },
        bounds_);
}

void PosedNbdTree::require_finite() const {
    const auto* exact = std::get_if<ExactBound>(&bounds_);
    const bool met_non_finite =
        (exact && exact->met_non_finite()) || spheres_.met_non_finite() || leaves_.met_non_finite();
    if (has_pose() && met_non_finite && !x_.are_on_demand()) require_finite_rows("vertex", x_.view());
}

}  // namespace nbd
