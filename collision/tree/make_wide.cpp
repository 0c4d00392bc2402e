#include "collision/tree/make_wide.hpp"

#include <utility>

namespace nbd {

NodeMargins node_margins(const CollisionTree& tree, BoundKind kind, std::optional<float> margin) {
    const auto calibration =
        tree.calibrations.find(kind == BoundKind::automatic ? BoundKind::learned_boxes : kind);
    if (margin || calibration == tree.calibrations.end())
        return {std::vector<float>(bound_count(tree, kind), margin.value_or(0.f)), {}};
    return {calibration->second.margins, calibration->second.limits};
}

AffineBoxes make_wide(const CollisionTree& tree, BoundKind kind, std::optional<float> margin) {
    std::optional<LearnedAffineBoxes> learned;
    if (kind == BoundKind::learned_affine)
        learned.emplace(tree.learned_affine, node_margins(tree, kind, margin));
    return AffineBoxes(tree.boxes ? tree.boxes : make_boxes(tree), std::move(learned));
}

}  // namespace nbd
