#include "collision/nbd_tree/posed_nbd_tree.hpp"

namespace nbd {

void PosedNbdTree::Posed::begin_pose(const VertexView& positions) noexcept {
    x = positions;
    std::visit([&](auto& b) { b.begin_pose(x.rows()); }, bounds);
    spheres.begin_pose(x);
}

const Sphere& PosedNbdTree::Posed::sphere(int node) noexcept {
    return std::visit([&](auto& b) -> const Sphere& { return spheres.get(node, b); }, bounds);
}

bool PosedNbdTree::Posed::met_non_finite() const noexcept {
    const auto* exact = std::get_if<ExactBound>(&bounds);
    return (exact && exact->met_non_finite()) || spheres.met_non_finite();
}

void PosedNbdTree::begin_pose(const VertexView& x) noexcept {
    in_step_ = false;
    posed_.begin_pose(x);
    leaves_.begin_pose(x);
}

void PosedNbdTree::begin_step(const VertexView& start, const VertexView& end) {
    reserve();
    in_step_ = true;
    at_start_->begin_pose(start);
    posed_.begin_pose(end);
    leaves_.begin_step(start, end);
}

void PosedNbdTree::reserve() {
    if (!at_start_) at_start_.emplace(posed_);
}

void PosedNbdTree::forget_pose() noexcept {
    in_step_ = false;
    posed_.x = {};
    posed_.spheres.forget_pose();
    leaves_.begin_pose({});
}

const Sphere& PosedNbdTree::sphere_of_step(int node) noexcept {
    const auto with_start = [&](const Sphere& at_end) { return joined(at_start_->sphere(node), at_end); };
    return std::visit(
        [&](auto& bounds) -> const Sphere& { return posed_.spheres.get(node, bounds, with_start); },
        posed_.bounds);
}

void PosedNbdTree::require_finite() const {
    if (!has_pose()) return;
    if (!posed_.met_non_finite() && !leaves_.met_non_finite() && !(in_step_ && at_start_->met_non_finite()))
        return;
    if (in_step_) require_finite_rows("vertex", at_start_->x);
    require_finite_rows("vertex", posed_.x);
}

}  // namespace nbd
