#include "collision/tree/posed_spheres.hpp"

namespace nbd {

void PosedSpheres::begin_pose(const Positions& x) noexcept {
    std::visit(
        [&](auto& b) {
            if constexpr (requires { b.begin_pose(x); })
                b.begin_pose(x);
            else
                b.begin_pose(x.rows());
        },
        bounds);
    spheres.begin_pose(x);
    boxes.begin_pose(x);
}

bool PosedSpheres::met_non_finite() const noexcept {
    const bool by_bounds = std::visit(
        [](const auto& b) {
            if constexpr (requires { b.met_non_finite(); })
                return b.met_non_finite();
            else
                return false;
        },
        bounds);
    return by_bounds || spheres.met_non_finite() || boxes.met_non_finite();
}

int PosedSpheres::nodes_bounded() const noexcept {
    return std::visit(
        [&](const auto& b) {
            if constexpr (requires { b.bounded(); })
                return b.bounded();
            else
                return spheres.bounded();
        },
        bounds);
}

int PosedSpheres::nodes_out_of_range() const noexcept {
    return std::visit(
        [&](const auto& b) {
            if constexpr (requires { b.out_of_range(); })
                return b.out_of_range();
            else
                return spheres.out_of_range();
        },
        bounds);
}

}  // namespace nbd
